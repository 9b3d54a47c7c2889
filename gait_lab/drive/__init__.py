"""Tools that move a running robot: keyboard teleoperation, teach-in of motions, calibration."""
