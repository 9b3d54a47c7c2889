"""From an image and the pose of its camera to percepts; no ROS, no network."""
