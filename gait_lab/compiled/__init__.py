"""Compiles the modules of the tick: the same source through mypyc, the same walk to the bit."""
