"""A NAO V6 instead of a simulated robot: its own interface, LoLA, behind the gait's topics.

`driver` is a process of its own that holds LoLA's socket and answers every frame in time, whatever
ROS does; what it answers is decided by `safety`. `ros` is the node that turns its frames into
topics and `joint_command` into commands. The package needs no simulator and no physics engine.
"""
