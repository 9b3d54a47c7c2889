"""The trajectory of the swing foot, from where it lifted off to where the next step needs it.

The end of the step and the step size may change in every tick. The phase therefore advances by the
share of the time that is left, and the foot by the share of the distance that is left. Both are
monotone, and nothing jumps when the plan changes.
"""

from math import cos, pi

from robot_core.geometry import rotate_planar
from robot_core.types import Pose2


def raised_cosine(phase: float) -> float:
    """0 to 1 for a phase of 0 to 1, with zero speed at both ends."""
    if phase <= 0.0:
        return 0.0
    if phase >= 1.0:
        return 1.0
    return 0.5 - 0.5 * cos(pi * phase)


class SwingFoot:
    """Pose of the swing sole in Q during one single support.

    Args:
        start: Pose of the sole in Q at lift-off.
        lift: Largest height [m].
        rise: Share of the phase for lifting, and again for lowering.
        travel_end: Share of the phase after which the foot no longer moves in x and y.
        toe_lift: Upward pitch of the toes per forward distance [rad/m].

    Attributes:
        phase: Progress of the step, 0 to 1.
    """

    def __init__(
        self, start: Pose2, lift: float, rise: float, travel_end: float, toe_lift: float = 0.0
    ):
        self.phase = 0.0
        self._start = start
        self._ahead = 0.0  # [m] forward from start to landing, not negative
        self._toe_lift = toe_lift
        self._x, self._y, self._yaw = start
        self._even_yaw = start[2]
        self._lift = lift
        self._rise = rise
        self._travel_end = travel_end

    @property
    def pose_in_q(self) -> Pose2:
        """Pose of the sole in Q."""
        return self._x, self._y, self._yaw

    @property
    def height(self) -> float:
        """Height of the sole above the ground [m]."""
        return self._lift * raised_cosine(min(self.phase, 1.0 - self.phase) / self._rise)

    @property
    def pitch(self) -> float:
        """Pitch of the sole [rad]; level at both ends.

        Joints that lag lower the toes of a fast foot. This lifts them by as much.
        """
        travelled = min(self.phase / self._travel_end, 1.0)
        share = raised_cosine(2.0 * min(travelled, 1.0 - travelled))
        return -self._toe_lift * self._ahead * share

    @property
    def yaw_behind(self) -> float:
        """Angle [rad] by which the sole is behind one that turns at a constant rate."""
        return self._even_yaw - self._yaw

    def move_towards(self, landing: Pose2, dt: float, time_left: float) -> None:
        """Advance by one tick.

        Args:
            landing: Pose of the sole in Q at touch-down.
            dt: Time since the last tick [s].
            time_left: Time from the last tick to touch-down [s].
        """
        time_share = 1.0 if time_left <= dt else dt / time_left
        x, y, _ = self._start
        ahead, _ = rotate_planar(landing[0] - x, landing[1] - y, -self._yaw)
        ahead = max(0.0, ahead)
        begins = self.phase == 0.0
        self._ahead = ahead if begins else self._ahead + time_share * (ahead - self._ahead)
        self._even_yaw += time_share * (landing[2] - self._even_yaw)
        before = raised_cosine(self.phase / self._travel_end)
        self.phase = 1.0 if time_share == 1.0 else self.phase + (1.0 - self.phase) * time_share
        after = raised_cosine(self.phase / self._travel_end)
        share = 1.0 if before >= 1.0 else (after - before) / (1.0 - before)
        self._x += share * (landing[0] - self._x)
        self._y += share * (landing[1] - self._y)
        self._yaw += share * (landing[2] - self._yaw)
