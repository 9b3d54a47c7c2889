"""State of a simulated robot: at the start, as input of a physics step, and exact after it."""

from dataclasses import dataclass
from typing import NamedTuple

from robot_core.types import FloatArray
from sim_bridge.body import BodyPose


@dataclass(frozen=True, slots=True)
class StartState:
    """Pose of a robot at rest at the start.

    Attributes:
        torso_position: (3,) [m] of the torso link frame in the world.
        torso_rotation: (4,) quaternion x y z w, torso to world.
        joint_position: (n,) [rad], true angles.
    """

    torso_position: FloatArray
    torso_rotation: FloatArray
    joint_position: FloatArray


class StepInput(NamedTuple):
    """What acts on one robot during one physics step.

    Attributes:
        setpoint: (n,) [rad] true joint angles that the servos are to reach.
        torque_scale: Share of the motors' torque limits that may be used, 0 to 1; one number for
            all motors, or (n,) for each.
        push_force: (3,) [N] in the world frame, on the centre of mass of the torso link.
    """

    setpoint: FloatArray
    torque_scale: float | FloatArray
    push_force: FloatArray


class TrueState(NamedTuple):
    """Exact state of one robot after a physics step.

    Attributes:
        torso_position: (3,) [m] of the torso link frame in the world.
        torso_rotation: (4,) quaternion x y z w, torso to world.
        torso_matrix: (3, 3) the same rotation.
        torso_linear_velocity: (3,) [m/s] of the torso link origin, in the world frame.
        torso_angular_velocity: (3,) [rad/s] in the torso frame.
        joint_position: (n,) [rad], true angles.
        joint_velocity: (n,) [rad/s].
        joint_torque: (n,) [N m] of the motors during the last step.
        sole_wrench: left, right (6,): force [N] and torque [N m] of the floor on the sole, about
            the origin of the sole frame, in its axes.
        legs_touch: The legs touched each other in any step since the last observation.
    """

    torso_position: FloatArray
    torso_rotation: FloatArray
    torso_matrix: FloatArray
    torso_linear_velocity: FloatArray
    torso_angular_velocity: FloatArray
    joint_position: FloatArray
    joint_velocity: FloatArray
    pose: BodyPose
    joint_torque: FloatArray
    sole_wrench: tuple[FloatArray, FloatArray]
    legs_touch: bool
