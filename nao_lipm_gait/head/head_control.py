"""Turns the head towards its goal within joint limits and speeds, while the body moves.

Without a goal the gait controls the head.
"""

from math import asin, atan2, cos, sin
from typing import NamedTuple

from nao_lipm_gait.geometry import dot
from nao_lipm_gait.head.gaze import neck_of
from nao_lipm_gait.head.goals import Angles, Follow, Frame, Goal, Search
from nao_lipm_gait.rate_limiter import limited_step
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, Point3, Pose2, Pose6
from nao_lipm_gait.whole_body.body_model import SolePose

SPEED = 3.0
"""[rad/s] Speed limit of both joints; slower than the motors, for sharp camera images."""
SPEED_SHARE = 0.9
"""Share of the joints' own speed limits, if that is lower."""
LOST = 1.0
"""[s] A search begins if a followed point is not updated for this long."""
SWEEP_SPEED = 0.8
"""[rad/s] Pan speed of a search."""
SWEEP_WIDTH = 1.2
"""[rad] Pan of a search to either side."""
SWEEP_TILTS = (0.1, 0.45)
"""[rad] Tilt of the far and the near line of a search."""


class TorsoPlace(NamedTuple):
    """Pose of the torso relative to the ground.

    Attributes:
        up: Unit vertical in the torso frame.
        left_sole: Left sole in the torso frame.
        right_sole: Right sole in the torso frame.
        base_footprint_in_odom: x, y [m], yaw [rad].
    """

    up: Point3
    left_sole: SolePose
    right_sole: SolePose
    base_footprint_in_odom: Pose2

    def from_footprint(self, point: Point3) -> Point3:
        """Transform a point from base_footprint to the torso frame [m]."""
        forward, left = self._ground_axes()
        x, y, z = point
        middle = tuple(
            0.5 * (a + b)
            for a, b in zip(self.left_sole.position, self.right_sole.position, strict=True)
        )
        ax, ay, az = (
            m + x * f + y * side + z * u
            for m, f, side, u in zip(middle, forward, left, self.up, strict=True)
        )
        return ax, ay, az

    def from_odom(self, point: Point3) -> Point3:
        """Transform a point from odom to the torso frame [m]."""
        bx, by, yaw = self.base_footprint_in_odom
        dx, dy, c, s = point[0] - bx, point[1] - by, cos(yaw), sin(yaw)
        return self.from_footprint((c * dx + s * dy, c * dy - s * dx, point[2]))

    def in_footprint(self) -> Pose6:
        """The torso in base_footprint: x, y, z [m], roll, pitch, yaw [rad]."""
        forward, left = self._ground_axes()
        axes = (forward, left, self.up)  # of base_footprint, in the torso frame
        middle = [
            0.5 * (a + b)
            for a, b in zip(self.left_sole.position, self.right_sole.position, strict=True)
        ]
        x, y, _ = (-sum(a * m for a, m in zip(axis, middle, strict=True)) for axis in axes)
        # The lower sole is on the ground.
        z = max(-dot(self.up, sole.position) for sole in (self.left_sole, self.right_sole))
        pitch = asin(min(max(-self.up[0], -1.0), 1.0))
        return x, y, z, atan2(self.up[1], self.up[2]), pitch, atan2(left[0], forward[0])

    def _ground_axes(self) -> tuple[Point3, Point3]:
        """Forward and left on the ground, in the torso frame: the mean heading of the soles."""
        mean = [
            a + b for a, b in zip(self.left_sole.forward, self.right_sole.forward, strict=True)
        ]
        along = sum(a * b for a, b in zip(mean, self.up, strict=True))
        x, y, z = (a - along * b for a, b in zip(mean, self.up, strict=True))
        size = (x * x + y * y + z * z) ** 0.5 or 1.0
        x, y, z = x / size, y / size, z / size
        ux, uy, uz = self.up
        return (x, y, z), (uy * z - uz * y, uz * x - ux * z, ux * y - uy * x)


class HeadControl:
    """Controls pan and tilt of one head.

    Attributes:
        goal: The goal; None leaves the head to the gait.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._neck = neck_of(robot)
        self.goal: Goal | None = None
        self._since = 0.0
        self._now: list[float] | None = None
        if self._neck is not None:
            pair = [self._neck.pan, self._neck.tilt]
            self._lower, self._upper = robot.lower[pair].tolist(), robot.upper[pair].tolist()
            limits = SPEED_SHARE * robot.velocity_limit[pair]
            self._speed = [min(SPEED, limit) for limit in limits.tolist()]

    @property
    def exists(self) -> bool:
        """True for a robot with pan and tilt joints."""
        return self._neck is not None

    @property
    def is_free(self) -> bool:
        """True if the gait controls the head."""
        return self._neck is None or (self.goal is None and self._now is None)

    def ask(self, goal: Goal | None) -> None:
        """Set a goal; None leaves the head to the gait."""
        keeps_searching = isinstance(goal, Search) and isinstance(self.goal, Search)
        if not keeps_searching:
            self._since = 0.0
        self.goal = goal

    def apply(self, position: FloatArray, place: TorsoPlace, dt: float) -> None:
        """Write pan and tilt of one tick into joint targets.

        Args:
            position: (n,) [rad] Joint targets.
            place: Pose of the torso.
            dt: [s] Control period.
        """
        neck = self._neck
        if neck is None or self.is_free:
            return
        before = self._now or [float(position[neck.pan]), float(position[neck.tilt])]
        wanted = self._wanted(place)
        if wanted is None:  # no goal any more: return to the gait's angles
            wanted = float(position[neck.pan]), float(position[neck.tilt])
        now = []
        for angle, last, low, high, speed in zip(
            wanted, before, self._lower, self._upper, self._speed, strict=True
        ):
            inside = min(max(angle, low), high)
            now.append(limited_step(last, inside, speed * dt))
        self._since += dt
        arrived = self.goal is None and now == list(wanted)
        self._now = None if arrived else now
        position[neck.pan], position[neck.tilt] = now

    def yield_to(self, position: FloatArray) -> None:
        """Continue from these joint targets later, because a motion turns the head now."""
        if self._neck is not None and (self.goal is not None or self._now is not None):
            self._now = [float(position[self._neck.pan]), float(position[self._neck.tilt])]

    def rest(self) -> None:
        """Start from the measured angles later, because the joints are relaxed now."""
        self._now = None

    def _wanted(self, place: TorsoPlace) -> tuple[float, float] | None:
        goal, neck = self.goal, self._neck
        if goal is None or neck is None:
            return None
        if isinstance(goal, Angles):
            return goal.pan, goal.tilt
        if isinstance(goal, Search):
            return sweep(self._since)
        if isinstance(goal, Follow) and self._since > LOST:
            pan, _ = neck.angles_to(self._in_torso(goal, place)) or (0.0, 0.0)
            return sweep(self._since - LOST, pan)
        angles = neck.angles_to(self._in_torso(goal, place))
        if angles is None and self._now is not None:
            return self._now[0], self._now[1]
        return angles

    @staticmethod
    def _in_torso(goal: Goal, place: TorsoPlace) -> Point3:
        if isinstance(goal, Angles | Search):
            return (1.0, 0.0, 0.0)
        if goal.frame is Frame.FOOTPRINT:
            return place.from_footprint(goal.point)
        if goal.frame is Frame.ODOM:
            return place.from_odom(goal.point)
        return goal.point


def sweep(time: float, start: float = 0.0) -> tuple[float, float]:
    """Pan and tilt [rad] of a search.

    The pan moves to and fro at one speed: along the far line in one direction, the near line back.

    Args:
        time: [s] Since the search began.
        start: [rad] Pan at which it began.

    Returns:
        Pan and tilt [rad].
    """
    leg = 2.0 * SWEEP_WIDTH / SWEEP_SPEED
    begin = min(max(start, -SWEEP_WIDTH), SWEEP_WIDTH)
    phase = (time + (begin + SWEEP_WIDTH) / SWEEP_SPEED) % (2.0 * leg)
    if phase < leg:
        return phase * SWEEP_SPEED - SWEEP_WIDTH, SWEEP_TILTS[0]
    return SWEEP_WIDTH - (phase - leg) * SWEEP_SPEED, SWEEP_TILTS[1]
