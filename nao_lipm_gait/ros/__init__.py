"""The ROS 2 side of the gait: process, node, parameters and message conversion, no behaviour.

`process`, `parameters` and the array and time converters in `messages` are shared: `sim_bridge`
builds its own node from them.
"""
