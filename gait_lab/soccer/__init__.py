"""Matches, challenges and single abilities of simulated players; trials of the world model."""
