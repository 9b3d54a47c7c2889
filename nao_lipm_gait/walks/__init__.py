"""The walk engines: `base` is their interface, `registry` lists them, `steps` is shared."""
