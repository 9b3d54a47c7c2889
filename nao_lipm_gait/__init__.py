"""CoM-observing 3D-LIPM gait after Graf and Roefer: a pure control core and one thin ROS 2 node."""
