"""Recording topics to a bag."""
