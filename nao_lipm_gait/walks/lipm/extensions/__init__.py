"""Extensions of the paper: stopping, turning steps, sensor offsets and recovery from pushes."""
