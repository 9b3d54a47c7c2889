"""One robot and its gait in one process, stepped by one loop."""
