"""Cameras of the simulated robots, without the engine that renders their images."""
