"""What a motion is: keyframes over time, for all joints or some."""

from dataclasses import dataclass
from enum import StrEnum

from nao_lipm_gait.types import FloatArray


class Posture(StrEnum):
    """How the robot is before or after a motion."""

    STANDING = "standing"
    SITTING = "sitting"
    LYING_FRONT = "lying_front"
    LYING_BACK = "lying_back"
    LYING_LEFT = "lying_left"
    LYING_RIGHT = "lying_right"
    UPRIGHT = "upright"
    """As a start: standing or sitting."""


LYING = (Posture.LYING_FRONT, Posture.LYING_BACK, Posture.LYING_LEFT, Posture.LYING_RIGHT)


class Interpolation(StrEnum):
    """How the joints get to a keyframe from the one before."""

    LINEAR = "linear"
    """At one speed."""
    CUBIC = "cubic"
    """From rest to rest, 3 s^2 - 2 s^3; its highest speed is 1.5 times the mean one."""

    @property
    def peak(self) -> float:
        """Highest speed over mean speed."""
        return 1.5 if self is Interpolation.CUBIC else 1.0

    def share(self, time_share: float) -> float:
        """Share of the way that is done after a share of the time, both 0 to 1."""
        s = min(max(time_share, 0.0), 1.0)
        return s * s * (3.0 - 2.0 * s) if self is Interpolation.CUBIC else s


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """A pose at the end of a stretch of time."""

    pose: str
    """Its name, for messages."""
    position: FloatArray | None
    """(n,) [rad]; NaN = this joint is not the motion's. None = the stand pose of the gait."""
    time: float
    """[s] since the keyframe before, or since the start."""
    interpolation: Interpolation
    stiffness: FloatArray
    """(n,) share of the motors' torque."""
    support: int
    """Leg that stands alone and is stabilised by the gyro: +1 left, -1 right; 0 none."""


@dataclass(frozen=True, slots=True)
class Balance:
    """Gyro stabilisation of a supporting leg, q_new = q + k_p w; eq (7) of Friedmann et al."""

    pitch: float = 0.0
    """[s] from the pitch rate to the ankle's pitch."""
    roll: float = 0.0
    """[s] from the roll rate to the ankle's roll."""
    hip_share: float = 0.0
    """Share of both that the hip gets too."""


@dataclass(frozen=True, slots=True)
class Kick:
    """What a kick is for. Seen from the middle between the soles of the standing robot, x forward.
    """

    x: float
    """[m] where the ball has to lie."""
    y: float
    """[m] left of the middle."""
    direction: float
    """[rad] in which it goes, counter-clockwise from forward."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Named, checked by `check.check_motion` before it may run."""

    name: str
    meaning: str
    starts: Posture
    ends: Posture
    keyframes: tuple[Keyframe, ...]
    balance: Balance = Balance()
    kick: Kick | None = None
    """None for motions that are no kick."""

    @property
    def time(self) -> float:
        """[s] from start to end, if the start pose is near enough for the first keyframe."""
        return sum(keyframe.time for keyframe in self.keyframes)

    @property
    def upright(self) -> bool:
        """On its feet from start to end: a tilt is then a fall."""
        return self.starts not in LYING and self.ends not in LYING

    @property
    def gets_up(self) -> bool:
        return self.starts in LYING

    def begins_from(self, posture: Posture) -> bool:
        if self.starts is Posture.UPRIGHT:
            return posture in (Posture.STANDING, Posture.SITTING)
        return self.starts is posture
