"""The ROS 2 side of the gait: one thin node and its message converters."""
