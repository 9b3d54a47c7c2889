"""State estimation: torso orientation, measured CoM, odometry, yaw slip, falls, lying side."""
