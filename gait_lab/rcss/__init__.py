"""Our robots on RoboCup's simulation server: a player without ROS, the start of a server."""
