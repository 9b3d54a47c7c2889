"""Tools that move a running robot: teleop, teach."""
