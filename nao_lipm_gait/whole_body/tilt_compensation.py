"""Corrects the swing foot of a tilted torso, so that it lands flat and on time.

Leg targets are meant for an upright torso. A pushed robot rotates as a whole about an edge of its
stance sole. The swing foot rotates with it, and lands early and on its toes. Its target is rotated
back by a share of the tilt, in position and in sole normal. A foot that has landed loses this
rotation slowly, which raises the torso.
"""

from math import exp

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from robot_core.types import LEFT

ROLL_GAIN = 0.5
"""Share of the roll error by which the swing foot is rotated back; as `tilt_pitch_gain`."""
COM_GAIN = 0.3
"""Share of the CoM's displacement by the tilt that is removed from its target."""
DEADBAND = 0.07
"""[rad] Smaller tilt errors belong to the walk and are not compensated."""
FOLLOW_TIME = 0.03
"""Time in which the swing foot follows a tilt [s]."""
RELEASE_TIME = 0.15
"""Time constant with which the stance foot loses its rotation [s]."""

Turn = tuple[float, float]
"""Roll and pitch [rad]."""


class TiltCompensation:
    """Rotates the target of the swing foot against the unwanted tilt of the torso."""

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
        """The targets with rotated feet.

        Args:
            targets: Targets of the body.
            support: Supporting leg, LEFT or RIGHT.
            tilt: Unwanted roll and pitch of the torso at the time of the targets [rad].
            parameters: Parameters of the gait.
            dt: Time since the last tick [s].

        Returns:
            The corrected targets.
        """
        p = parameters
        roll, pitch = _beyond_deadband(tilt[0]), _beyond_deadband(tilt[1])
        roll_gain, com_gain = (ROLL_GAIN, COM_GAIN) if p.tilt_pitch_gain > 0.0 else (0.0, 0.0)
        wanted = -roll_gain * roll, -p.tilt_pitch_gain * pitch
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
        com = x - z * (com_gain * pitch), y + z * (com_gain * roll), z
        return targets.on_soles(com, left, right)


def _beyond_deadband(angle: float) -> float:
    return max(angle - DEADBAND, 0.0) + min(angle + DEADBAND, 0.0)


def _approach(turn: Turn, wanted: Turn, share: float) -> Turn:
    share = min(share, 1.0)
    return turn[0] + share * (wanted[0] - turn[0]), turn[1] + share * (wanted[1] - turn[1])


def _rise(swing: SoleTarget, stance: SoleTarget, turn: Turn) -> float:
    """Height that the swing sole gains by a rotation about the stance sole [m]."""
    roll, pitch = turn
    return (swing.y - stance.y) * roll - (swing.x - stance.x) * pitch


def _turned(sole: SoleTarget, turn: Turn, rise: float = 0.0) -> SoleTarget:
    return SoleTarget(
        sole.x, sole.y, sole.z + rise, sole.yaw, sole.pitch + turn[1], sole.roll + turn[0]
    )
