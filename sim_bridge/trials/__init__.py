"""One loop that steps a world and its gait; walks, pushes, kicks and get-ups are policies of it."""
