"""The pendulum walk of Graf and Roefer, one file per stage of the paper."""
