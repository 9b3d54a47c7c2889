"""The head: where it shall look, and the two angles that make it look there."""
