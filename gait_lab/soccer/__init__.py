"""Matches and challenges of simulated players; trials of the world model."""
