"""Legs and body: joint angles from sole and CoM targets."""
