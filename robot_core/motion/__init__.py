"""Keyframe motions: their files, checks and library."""
