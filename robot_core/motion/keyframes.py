"""What a motion is: keyframes over time, for all joints or some."""

import math
from dataclasses import dataclass
from enum import StrEnum

import attrs

from robot_core.rate_limiter import eased
from robot_core.schema import Settings, number
from robot_core.types import FloatArray


class Posture(StrEnum):
    """Posture before or after a motion; UPRIGHT, as a start, is either of the first two."""

    STANDING = "standing"
    SITTING = "sitting"
    LYING_FRONT = "lying_front"
    LYING_BACK = "lying_back"
    LYING_LEFT = "lying_left"
    LYING_RIGHT = "lying_right"
    UPRIGHT = "upright"


LYING = (Posture.LYING_FRONT, Posture.LYING_BACK, Posture.LYING_LEFT, Posture.LYING_RIGHT)


class Interpolation(StrEnum):
    """How joints move between keyframes: at one speed, or from rest to rest (3 s^2 - 2 s^3)."""

    LINEAR = "linear"
    CUBIC = "cubic"

    @property
    def peak(self) -> float:
        """Highest speed over mean speed."""
        return 1.5 if self is Interpolation.CUBIC else 1.0

    def share(self, time_share: float) -> float:
        """Share of the distance after a share of the time, both 0 to 1."""
        s = min(max(time_share, 0.0), 1.0)
        return eased(s) if self is Interpolation.CUBIC else s


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """A pose at the end of an interval.

    Attributes:
        pose: Name of the pose, for messages.
        position: (n,) [rad]; NaN for joints that the motion does not move. None is the gait's stand
            pose.
        time: [s] Since the last keyframe, or since the start.
        interpolation: How the joints get there.
        stiffness: (n,) Share of the motors' torque.
        support: Leg that stands alone and is stabilised with the gyro: +1 left, -1 right, 0 none.
    """

    pose: str
    position: FloatArray | None
    time: float
    interpolation: Interpolation
    stiffness: FloatArray
    support: int


@attrs.frozen
class Balance(Settings):
    """Gyro stabilisation of a supporting leg, q_new = q + k_p w; eq (7) of Friedmann et al."""

    pitch: float = number(0.0, -0.5, 0.5, "s", "k_p from the pitch rate to the ankle's pitch.")
    roll: float = number(0.0, -0.5, 0.5, "s", "k_p from the roll rate to the ankle's roll.")
    hip_share: float = number(0.0, -0.5, 0.5, "", "Share of both that is added to the hip.")


@attrs.frozen
class Kick(Settings):
    """Where a kick expects the ball and where it sends it.

    The origin is the middle between the soles of the standing robot, x points forward.
    """

    x: float = number(minimum=-1.0, maximum=1.0, unit="m", meaning="Position of the ball.")
    y: float = number(minimum=-1.0, maximum=1.0, unit="m", meaning="Position of the ball.")
    direction: float = number(
        minimum=-math.pi, maximum=math.pi, unit="rad",
        meaning="Direction of the kick, counter-clockwise from forward.",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A motion; `check.check_motion` checks it before it may run.

    Attributes:
        name: Its name.
        meaning: What it does.
        starts: Posture in which it may start.
        ends: Posture in which it ends.
        keyframes: Keyframes, at least one.
        balance: Gyro stabilisation of keyframes with a support leg.
        kick: None for motions that are no kick.
        legs_press: The targets lead the legs into each other, where they press.
    """

    name: str
    meaning: str
    starts: Posture
    ends: Posture
    keyframes: tuple[Keyframe, ...]
    balance: Balance = Balance()
    kick: Kick | None = None
    legs_press: bool = False

    @property
    def time(self) -> float:
        """[s] From start to end, if the start pose is close enough to the first keyframe."""
        return sum(keyframe.time for keyframe in self.keyframes)

    @property
    def upright(self) -> bool:
        """True if the robot is on its feet from start to end; a tilt is then a fall."""
        return self.starts not in LYING and self.ends not in LYING

    @property
    def gets_up(self) -> bool:
        """True for a motion that starts lying."""
        return self.starts in LYING

    def begins_from(self, posture: Posture) -> bool:
        """True if the motion may start in this posture."""
        if self.starts is Posture.UPRIGHT:
            return posture in (Posture.STANDING, Posture.SITTING)
        return self.starts is posture
