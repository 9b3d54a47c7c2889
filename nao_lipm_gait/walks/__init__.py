"""The walk engines, listed in `walk_engines.py`: `base` is their interface, `steps` is shared."""
