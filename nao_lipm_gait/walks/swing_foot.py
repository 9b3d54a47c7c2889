"""The swing foot's way from where it left the ground to where the next phase needs it.

t_e and the step size may change in every tick. The phase therefore advances by the share of the
time that is left, and the foot by the share of the way that is left: both are monotone, and nothing
jumps however the plan moves.
"""

from math import cos, pi

from nao_lipm_gait.geometry import rotate_planar
from nao_lipm_gait.types import Pose2


def raised_cosine(phase: float) -> float:
    """From 0 to 1 with no speed at both ends."""
    if phase <= 0.0:
        return 0.0
    if phase >= 1.0:
        return 1.0
    return 0.5 - 0.5 * cos(pi * phase)


class SwingFoot:
    """Pose of the swing sole in Q during one single support phase."""

    def __init__(
        self, start: Pose2, lift: float, rise: float, travel_end: float, toe_lift: float = 0.0
    ):
        """start: sole pose in Q; lift [m]; rise, travel_end: shares of the phase; toe_lift
        [rad/m]: by which the toes go up per way forward.
        """
        self.phase = 0.0
        self._start = start
        self._ahead = 0.0
        """[m] forward from start to landing; backwards counts as none."""
        self._toe_lift = toe_lift
        self._x, self._y, self._yaw = start
        self._lift = lift
        self._rise = rise
        self._travel_end = travel_end

    @property
    def pose_in_q(self) -> Pose2:
        return self._x, self._y, self._yaw

    @property
    def height(self) -> float:
        """Height of the sole above the ground [m]."""
        return self._lift * raised_cosine(min(self.phase, 1.0 - self.phase) / self._rise)

    @property
    def pitch(self) -> float:
        """Of the sole [rad]; level at both ends of the way.

        Joints that lag leave the toes of a fast foot hanging, by as much as they are lifted here.
        """
        travelled = min(self.phase / self._travel_end, 1.0)
        share = raised_cosine(2.0 * min(travelled, 1.0 - travelled))
        return -self._toe_lift * self._ahead * share

    def move_towards(self, landing: Pose2, dt: float, time_left: float) -> None:
        """Advance by dt [s] with time_left [s] to touch-down at `landing`, a sole pose in Q."""
        time_share = 1.0 if time_left <= dt else dt / time_left
        x, y, _ = self._start
        ahead, _ = rotate_planar(landing[0] - x, landing[1] - y, -self._yaw)
        ahead = max(0.0, ahead)
        begins = self.phase == 0.0
        self._ahead = ahead if begins else self._ahead + time_share * (ahead - self._ahead)
        before = raised_cosine(self.phase / self._travel_end)
        self.phase = 1.0 if time_share == 1.0 else self.phase + (1.0 - self.phase) * time_share
        after = raised_cosine(self.phase / self._travel_end)
        share = 1.0 if before >= 1.0 else (after - before) / (1.0 - before)
        self._x += share * (landing[0] - self._x)
        self._y += share * (landing[1] - self._y)
        self._yaw += share * (landing[2] - self._yaw)
