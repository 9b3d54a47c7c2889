"""Offline tools on the gait and its simulated robot: rollouts, benchmarks, demo, figures."""
