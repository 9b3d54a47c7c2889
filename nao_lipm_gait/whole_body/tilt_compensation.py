"""The swing foot of a tilted torso, put where it belongs against gravity.

Leg targets are meant for an upright torso. A pushed robot turns as a whole about an edge of its
stance sole, the swing foot with it, which then lands early and on its toes. Its target is turned
back by a share of the tilt, in position and in sole normal. A foot that has landed gives its turn
back slowly, which raises the torso.
"""

from math import exp

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import LEFT
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget

FOLLOW_TIME = 0.03
"""[s] in which a swing foot takes up a tilt."""
RELEASE_TIME = 0.15
"""[s] in which a stance foot gives it back."""

Turn = tuple[float, float]
"""Roll and pitch [rad]."""


class TiltCompensation:
    """Turns the swing foot's target against the torso's unwanted tilt."""

    def __init__(self) -> None:
        self._turns: dict[int, Turn] = {+1: (0.0, 0.0), -1: (0.0, 0.0)}

    def apply(
        self,
        targets: BodyTargets,
        support: int,
        tilt: Turn,
        parameters: GaitParameters,
        dt: float,
    ) -> BodyTargets:
        """The targets with turned feet; support: +1 left or -1 right; tilt: roll and pitch [rad] of
        the torso beyond what was wanted, at the time of the targets.
        """
        p = parameters
        roll, pitch = _beyond(tilt[0], p.tilt_deadband), _beyond(tilt[1], p.tilt_deadband)
        wanted = -p.tilt_roll_gain * roll, -p.tilt_pitch_gain * pitch
        turns = self._turns
        turns[-support] = _approach(turns[-support], wanted, dt / FOLLOW_TIME)
        turns[support] = _approach(turns[support], (0.0, 0.0), 1.0 - exp(-dt / RELEASE_TIME))
        if turns[+1] == turns[-1] == (roll, pitch) == (0.0, 0.0):
            return targets
        left, right = targets.left_sole, targets.right_sole
        if support == LEFT:
            right = _turned(right, turns[-1], _rise(right, left, turns[-1]))
            left = _turned(left, turns[+1])
        else:
            left = _turned(left, turns[+1], _rise(left, right, turns[+1]))
            right = _turned(right, turns[-1])
        x, y, z = targets.com_in_q
        com = x - z * (p.tilt_com_gain * pitch), y + z * (p.tilt_com_gain * roll), z
        return BodyTargets(
            com, left, right, targets.torso_roll, targets.torso_pitch, targets.q_in_odom
        )


def _beyond(angle: float, deadband: float) -> float:
    return max(angle - deadband, 0.0) + min(angle + deadband, 0.0)


def _approach(turn: Turn, wanted: Turn, share: float) -> Turn:
    share = min(share, 1.0)
    return turn[0] + share * (wanted[0] - turn[0]), turn[1] + share * (wanted[1] - turn[1])


def _rise(swing: SoleTarget, stance: SoleTarget, turn: Turn) -> float:
    """[m] by which the swing sole goes up when it is turned about the stance sole."""
    roll, pitch = turn
    return (swing.y - stance.y) * roll - (swing.x - stance.x) * pitch


def _turned(sole: SoleTarget, turn: Turn, rise: float = 0.0) -> SoleTarget:
    return SoleTarget(
        sole.x, sole.y, sole.z + rise, sole.yaw, sole.pitch + turn[1], sole.roll + turn[0]
    )
