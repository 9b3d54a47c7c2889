"""Between a message and a tick, without ROS."""
