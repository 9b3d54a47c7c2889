"""Torso orientation, CoM and odometry of a recorded walk, by the estimators of the gait."""
