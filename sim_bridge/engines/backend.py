"""What a physics engine must offer: four methods, one for faults, and two for a ball.

Everything else is shared code.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from nao_lipm_gait.types import FloatArray
from sim_bridge.ball import BallState
from sim_bridge.body import BodyPose


@dataclass(frozen=True, slots=True)
class StartState:
    """Where a simulation begins, at rest."""

    torso_position: FloatArray
    """(3,) [m] of the torso link frame in the world."""
    torso_rotation: FloatArray
    """(4,) quaternion x y z w, torso to world."""
    joint_position: FloatArray
    """(n,) [rad], true angles."""


class TrueState(NamedTuple):
    """The exact state of the robot after a physics step."""

    torso_position: FloatArray
    """(3,) [m] of the torso link frame in the world."""
    torso_rotation: FloatArray
    """(4,) quaternion x y z w, torso to world."""
    torso_matrix: FloatArray
    """(3, 3) the same rotation."""
    torso_linear_velocity: FloatArray
    """(3,) [m/s] of the torso link origin, in the world frame."""
    torso_angular_velocity: FloatArray
    """(3,) [rad/s] in the torso frame."""
    joint_position: FloatArray
    """(n,) [rad], true angles."""
    joint_velocity: FloatArray
    """(n,) [rad/s]."""
    pose: BodyPose
    """Where that puts the centre of mass and the soles."""
    joint_torque: FloatArray
    """(n,) [N m] that the motors put out during the last step."""
    sole_wrench: tuple[FloatArray, FloatArray]
    """Left, right (6,): force [N] and torque [N m] of the floor on the sole, about the origin of
    the sole frame, in its axes."""
    legs_touch: bool
    """The legs touched each other in any step since the last observation."""


class Backend(Protocol):
    """A physics engine with one robot on a floor."""

    def reset(self, start: StartState) -> None:
        """Put the robot there, at rest, with no memory of what was before."""

    def step(
        self, setpoint: FloatArray, torque_scale: float | FloatArray, push_force: FloatArray
    ) -> None:
        """Advance by one physics step.

        Args:
            setpoint: (n,) [rad] true joint angles that the servos aim at.
            torque_scale: share of the motors' torque limits that may be used, 0 to 1; for all
                motors, or (n,) for each.
            push_force: (3,) [N] in the world frame, on the centre of mass of the torso link.
        """

    def observe(self) -> TrueState:
        """The state now."""

    def disturb(self, torque_share: FloatArray, friction: float | None) -> None:
        """Let something break, until the next call; a reset repairs nothing.

        Args:
            torque_share: (n,) of each motor's torque that is left, 0 to 1.
            friction: of both soles on the floor; None = the individual's own.
        """

    def ball(self) -> BallState | None:
        """The ball now; None in a world without one."""

    def put_ball(self, position: FloatArray) -> None:
        """Lay the ball at rest at (3,) [m] in the world."""

    def close(self) -> None:
        """Free the engine; allowed more than once."""
