"""The tour over ROS 2."""
