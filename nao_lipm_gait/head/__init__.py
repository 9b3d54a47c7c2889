"""The head: goals, gaze angles and control."""
