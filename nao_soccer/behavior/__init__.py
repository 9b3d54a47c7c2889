"""Behaviour: what a robot does, decided at every update of its world model."""
