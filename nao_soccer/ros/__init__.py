"""ROS 2 nodes of the mind: nothing but conversion."""
