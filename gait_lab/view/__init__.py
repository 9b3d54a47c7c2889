"""`nao_gait view`: the robot live in the browser, over ROS."""
