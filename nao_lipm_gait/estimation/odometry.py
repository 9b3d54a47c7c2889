"""Odometry by the legs: the support sole stands still, the other sole is placed relative to it."""

from nao_lipm_gait.estimation.com_measurement import LevelFrame
from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.geometry import ORIGIN, compose, midpoint, relative
from robot_core.types import Pose2

VELOCITY_TIME = 0.25
"""Time constant [s] by which the velocity is smoothed, about one step."""


class Odometry:
    """Pose of base_footprint, the middle between the soles (REP-120), in odom.

    Attributes:
        velocity: Velocity of base_footprint in its own frame [m/s, m/s, rad/s].
        support_sole_in_odom: Pose of the support sole.
    """

    def __init__(self) -> None:
        self.velocity: Pose2 = (0.0, 0.0, 0.0)
        self.support_sole_in_odom: Pose2 = ORIGIN
        self._support = 0
        self._base: Pose2 | None = None

    @property
    def base_footprint_in_odom(self) -> Pose2:
        """Pose of base_footprint; the origin before the first tick."""
        return self._base or ORIGIN

    def hold(self, turned: float = 0.0) -> None:
        """Keep the place, at rest: the robot lies or gets up, so no sole stands still.

        The pose goes on from here, so that odom stays continuous (REP-105). How far the robot was
        shoved meanwhile is not known.

        Args:
            turned: Angle [rad] by which it turned since the last tick, where a gyro measures it.
        """
        self.velocity = (0.0, 0.0, 0.0)
        self._support = 0
        x, y, yaw = self.base_footprint_in_odom
        self._base = x, y, yaw + turned

    def update(
        self,
        support: int,
        support_sole: LevelFrame,
        other_sole: SolePose,
        dt: float,
        yaw_slip: float = 0.0,
    ) -> None:
        """One tick.

        Args:
            support: Support leg, `LEFT` or `RIGHT`.
            support_sole: Level frame of the support sole.
            other_sole: The other sole in the torso frame.
            dt: Time [s] since the last tick.
            yaw_slip: Angle [rad] by which the support sole has turned on the ground.
        """
        other = support_sole.pose_of(other_sole)
        if self._support == 0:
            sole_in_base = relative(ORIGIN, midpoint(ORIGIN, other))
            self.support_sole_in_odom = compose(self.base_footprint_in_odom, sole_in_base)
        elif support != self._support:
            # The other sole is the support sole of the last tick, whose pose in odom is known.
            self.support_sole_in_odom = compose(self.support_sole_in_odom, relative(ORIGIN, other))
        self._support = support
        x, y, yaw = self.support_sole_in_odom
        self.support_sole_in_odom = x, y, yaw + yaw_slip
        base = midpoint(self.support_sole_in_odom, compose(self.support_sole_in_odom, other))
        if self._base is not None:
            moved = relative(base, self._base)
            share = min(1.0, dt / VELOCITY_TIME)
            vx, vy, vyaw = self.velocity
            self.velocity = (
                vx + share * (moved[0] / dt - vx),
                vy + share * (moved[1] / dt - vy),
                vyaw + share * (moved[2] / dt - vyaw),
            )
        self._base = base
