"""Tuning: a study in a YAML file, a search method, workers, and a gait preset that comes out."""
