"""Trials of the soccer software: recorded walks, sampled percepts, errors of the world model."""
