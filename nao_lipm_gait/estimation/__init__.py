"""What the sensors say: torso orientation, measured CoM, odometry."""
