"""Between the joints of LoLA (25 motors) and those of the gait (22 axes)."""

from collections.abc import Sequence

import numpy as np

from lola_bridge.codec import JOINTS
from robot_core.errors import NaoGaitError
from robot_core.motion.keyframes import Posture
from robot_core.motion.library import shipped_library
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray

UNUSED_RANGE = {"LWristYaw": (-1.8238, 1.8238), "RWristYaw": (-1.8238, 1.8238),
                "LHand": (0.0, 1.0), "RHand": (0.0, 1.0)}  # fmt: skip
"""[rad], hands: closed to open. Motors that the gait does not have; they stay limp."""


class JointMap:
    """Converts joint arrays.

    One motor turns both hips: LoLA's LHipYawPitch is read for both and commanded by the leader.

    Args:
        robot: A NAO.

    Attributes:
        names: The joints that are measured: LoLA's, and those that share a motor of LoLA.
        driven: (25,) Motors that the gait drives.
    """

    def __init__(self, robot: RobotDescription) -> None:
        leader = {follower: first for first, follower in robot.coupled_joints}
        motors = {joint: leader.get(joint, joint) for joint in robot.joint_names}
        missing = [motor for motor in motors.values() if motor not in JOINTS]
        if missing:
            allowed = "a NAO: " + ", ".join(JOINTS)
            raise NaoGaitError(f"robot {robot.name}: joint", missing[0], allowed)
        self._robot = robot
        self._to_gait = [JOINTS.index(motors[joint]) for joint in robot.joint_names]
        self._from_gait = {joint: robot.index(joint) for joint in motors.values()}
        followers = tuple(joint for joint in robot.joint_names if joint in leader)
        self.names = (*JOINTS, *followers)
        self._measured = [*range(len(JOINTS)), *(JOINTS.index(leader[j]) for j in followers)]
        self.driven = [joint in self._from_gait for joint in JOINTS]

    def measured(self, values: Sequence[float]) -> list[float]:
        """Values (25,) of LoLA for the joints of `names`."""
        return [values[index] for index in self._measured]

    def to_gait(self, values: Sequence[float]) -> list[float]:
        """Values (25,) of LoLA for the joints of the gait (22,)."""
        return [values[index] for index in self._to_gait]

    def from_gait(self, values: Sequence[float] | FloatArray, rest: float = 0.0) -> list[float]:
        """Values (22,) of the gait for the motors of LoLA (25,); `rest` for the others."""
        given = self._from_gait
        return [float(values[given[joint]]) if joint in given else rest for joint in JOINTS]

    def limits(self) -> tuple[list[float], list[float], list[float]]:
        """Lower and upper limit [rad] and largest speed [rad/s] of each motor (25,)."""
        rows = []
        for joint in JOINTS:
            if joint in self._from_gait:
                limit = self._robot.limits[joint]
                rows.append((limit.lower, limit.upper, limit.velocity))
            else:
                rows.append((*UNUSED_RANGE[joint], 1.0))
        lower, upper, speed = zip(*rows, strict=True)
        return list(lower), list(upper), list(speed)


def sitting_pose(robot: RobotDescription) -> FloatArray:
    """(22,) [rad] the last pose of the shipped motion that ends sitting; the head as it stands.

    Raises:
        NaoGaitError: The robot has none.
    """
    motion = shipped_library(robot).between(Posture.STANDING, Posture.SITTING)
    pose = None if motion is None else motion.keyframes[-1].position
    if pose is None:
        raise NaoGaitError(f"robot {robot.name}: motions", "none that sits down", "one")
    return np.where(np.isnan(pose), robot.stand_pose, pose)
