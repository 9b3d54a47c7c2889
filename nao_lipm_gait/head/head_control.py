"""Turns the head towards its goal within joint limits and speeds, while the body moves.

Without a goal the gait controls the head.
"""


from nao_lipm_gait.estimation.torso_place import TorsoPlace
from nao_lipm_gait.head.gaze import neck_of
from robot_core.head_goals import Angles, Follow, Frame, Goal, Search
from robot_core.rate_limiter import limited_step
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point3

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
        else:
            wanted = wanted[0] * neck.signs[0], wanted[1] * neck.signs[1]
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
            return self._now[0] * neck.signs[0], self._now[1] * neck.signs[1]
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
