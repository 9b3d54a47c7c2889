"""Runs keyframe motions: scheduler and player."""
