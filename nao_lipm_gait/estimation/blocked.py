"""Whether the soles slip: a robot that is blocked, held or pushed walks on in its odometry.

While the support sole at s in the torso frame stands still, joints and gyro tell the lateral
specific force of the torso, with the height h over the sole:

    f_y = -s_y'' - h w_x' + g (integral of w_x)

The share of the force that this leaves unexplained is small as long as the robot sways freely, and
grows when it rubs against something. All signals pass one band, so that constant errors and noise
do not count. Soles that rock leave more unexplained, so a robot is compared with its best walk.
"""

from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.types import GRAVITY, LEFT

SMOOTH_TIME, BAND_TIME = 0.02, 0.25
"""[s] Time constants of the band, each twice."""
MEMORY = 1.0
"""[s] Time constant with which the sway is forgotten."""
LIMIT, TIMES_USUAL = 0.35, 3.0
"""Share of the force from which on the soles slip, or that share of the robot's usual one. Usual
are 0.02 to 0.12; rubbing robots reach 0.3 to 4."""
FORGET_TIME = 60.0
"""[s] in which the usual share grows by 1 if the robot no longer reaches it."""


class SlipDetector:
    """Compares the force of the sway with that by the legs, one tick of a walk after the other.

    Attributes:
        slipping: The soles slip.
        share: Part of the force's power that is unexplained, 0 to 1 and more; 0 = not known.
    """

    def __init__(self) -> None:
        self._usual = float("inf")
        self.restart()

    def restart(self) -> None:
        """The walk ends."""
        self.slipping = False
        self.share = 0.0
        self._soles: tuple[SolePose, SolePose] | None = None
        self._rate = self._angle = self._speed = 0.0
        self._force_stages = [0.0] * 4
        self._legs_stages = [0.0] * 4
        self._power = self._unexplained = self._time = 0.0

    def update(
        self, support: int, soles: tuple[SolePose, SolePose], force: float, rate: float, dt: float
    ) -> None:
        """One tick.

        Args:
            support: Support leg, LEFT or RIGHT.
            soles: Left and right sole in the torso frame.
            force: Specific force along y of the torso [m/s^2].
            rate: Rate of roll [rad/s].
            dt: Time [s] since the last tick.
        """
        if self._soles is None:
            self._soles, self._rate = soles, rate
            self._force_stages[:2] = force, force
            return
        side = 0 if support == LEFT else 1
        _, y, z = soles[side].position
        speed = (self._soles[side].position[1] - y) / dt
        self._angle += dt * rate
        legs = (speed - self._speed + z * (rate - self._rate)) / dt + GRAVITY * self._angle
        self._soles, self._speed, self._rate = soles, speed, rate
        force = _in_band(self._force_stages, force, dt)
        rest = force - _in_band(self._legs_stages, legs, dt)
        keep = 1.0 - min(1.0, dt / MEMORY)
        self._power = keep * self._power + dt * force * force
        self._unexplained = keep * self._unexplained + dt * rest * rest
        self._time += dt
        if self._time > 2.0 * MEMORY and self._power > 0.0:
            self.share = self._unexplained / self._power
            self._usual = min(self.share, self._usual + dt / FORGET_TIME)
            limit = max(LIMIT, TIMES_USUAL * self._usual)
            self.slipping = self.share > (0.5 * limit if self.slipping else limit)


def _in_band(stages: list[float], value: float, dt: float) -> float:
    """The value within the band, whose stages are updated."""
    for index, time in enumerate((SMOOTH_TIME, SMOOTH_TIME, BAND_TIME, BAND_TIME)):
        stages[index] += dt / (time + dt) * (value - stages[index])
        value = stages[index] if time == SMOOTH_TIME else value - stages[index]
    return value
