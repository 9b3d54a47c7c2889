"""The world model: percepts and odometry in, own pose, ball, obstacles and team mates out."""
