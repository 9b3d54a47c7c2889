"""The second paper's walk: ZMP trajectories over a fixed cadence, stabilised by the gyro alone."""
