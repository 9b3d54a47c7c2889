"""Odometry from the feet: the support sole stands still, the other one says where it will."""

from nao_lipm_gait.estimation.com_measurement import LevelFrame
from nao_lipm_gait.geometry import compose, midpoint, relative
from nao_lipm_gait.types import Pose2
from nao_lipm_gait.whole_body.body_model import SolePose

VELOCITY_TIME = 0.25
"""[s] smoothing of the velocity, about one step."""


class Odometry:
    """Pose of base_footprint (between the soles, REP-120) in odom."""

    def __init__(self) -> None:
        self._support = 0
        self._sole_in_odom: Pose2 = (0.0, 0.0, 0.0)
        self._base: Pose2 | None = None
        self._velocity: Pose2 = (0.0, 0.0, 0.0)

    @property
    def base_footprint_in_odom(self) -> Pose2:
        return self._base or (0.0, 0.0, 0.0)

    @property
    def support_sole_in_odom(self) -> Pose2:
        return self._sole_in_odom

    @property
    def velocity(self) -> Pose2:
        """Of base_footprint, in its own frame [m/s, m/s, rad/s]."""
        return self._velocity

    def update(
        self,
        support: int,
        support_sole: LevelFrame,
        other_sole: SolePose,
        dt: float,
        stance_turn: float = 0.0,
    ) -> None:
        """One tick: support +1 left or -1 right; the other sole in the torso frame.

        stance_turn [rad]: by how much the support sole has turned on the ground, where known.
        """
        other_seen = support_sole.pose_of(other_sole)
        if self._support == 0:
            self._sole_in_odom = relative((0.0, 0.0, 0.0), midpoint((0.0, 0.0, 0.0), other_seen))
        elif support != self._support:
            # What is now "other" was the support: where it stood says where the new one stands.
            back = relative((0.0, 0.0, 0.0), other_seen)
            self._sole_in_odom = compose(self._sole_in_odom, back)
        self._support = support
        x, y, yaw = self._sole_in_odom
        self._sole_in_odom = x, y, yaw + stance_turn
        base = midpoint(self._sole_in_odom, compose(self._sole_in_odom, other_seen))
        if self._base is not None:
            moved = relative(base, self._base)
            share = min(1.0, dt / VELOCITY_TIME)
            vx, vy, vyaw = self._velocity
            self._velocity = (
                vx + share * (moved[0] / dt - vx),
                vy + share * (moved[1] / dt - vy),
                vyaw + share * (moved[2] / dt - vyaw),
            )
        self._base = base
