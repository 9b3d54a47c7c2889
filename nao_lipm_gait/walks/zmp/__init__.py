"""The walk of the second paper (Friedmann et al.): ZMP trajectories at a fixed cadence."""
