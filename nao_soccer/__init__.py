"""Soccer: the field, and what is built on the gait's topics."""
