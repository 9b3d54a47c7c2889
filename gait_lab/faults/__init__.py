"""Faults of a gait, of a player in a match, and of a robot's node processes; see `scopes`."""
