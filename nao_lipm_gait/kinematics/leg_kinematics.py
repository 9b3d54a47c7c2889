"""What the gait asks of a pair of legs, whatever their hips look like."""

from typing import NamedTuple, Protocol

from nao_lipm_gait.kinematics.body_model import SolePose


class LegAngles(NamedTuple):
    """One leg from the hip down [rad]."""

    hip_yaw: float
    hip_roll: float
    hip_pitch: float
    knee_pitch: float
    ankle_pitch: float
    ankle_roll: float


class LegSolution(NamedTuple):
    """Joint angles for two wanted soles, and how far they miss."""

    left: LegAngles
    right: LegAngles
    left_yaw_error: float
    right_yaw_error: float
    """[rad] wanted minus reached turn of each sole about its own normal."""
    reach_error: float
    """[m] by which the farther sole lies beyond the reach of its leg; 0 when in reach."""


class LegKinematics(Protocol):
    """Position and sole normal are met exactly wherever they are in reach."""

    def solve(self, left: SolePose, right: SolePose, *, again: bool = False) -> LegSolution:
        """Joint angles for two soles given in the torso frame.

        again: for the same tick as the last call; may be used for a good first guess.
        """
