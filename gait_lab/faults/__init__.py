"""Faults between a simulated robot and its gait, in lockstep, in one process, without DDS."""
