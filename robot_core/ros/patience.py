"""How long processes wait for each other by the wall clock [s]; a machine may be busy."""

START = 300.0
"""Until all nodes of a run are found, or the first sensors come."""
STALL = 120.0
"""Without a new time on `/clock`."""
ANSWER = 30.0
"""For the answer of a service or a node that runs."""
