"""The node around the world."""
