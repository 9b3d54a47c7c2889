"""How well a robot sees: rendered walks, what is to be seen in them, and scores."""
