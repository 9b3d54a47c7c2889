"""Keyframe motions: files, checks, player and scheduler."""
