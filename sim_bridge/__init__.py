"""The stand-in for the robot: physics, motors, sensors and their delay behind ROS 2 topics."""
