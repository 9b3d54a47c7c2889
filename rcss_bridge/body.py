"""One player's body: percepts become sensor frames, joint targets become actions."""

import numpy as np

from rcss_bridge.codec import Motor, Percepts
from rcss_bridge.joints import ServerRobot
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import JointTargets, SensorFrame

CYCLE = 0.02
"""[s] between two messages of the server."""
_CYCLE_NS = 20_000_000
_TIME_STEP = 0.01
"""[s] to which the server cuts the time."""
LIMP_SHARE = 0.1
"""Share of its damping that a limp joint keeps."""


class Body:
    """Converts for one robot.

    Args:
        server_robot: The server's names.
        robot: The description of the same robot; the gains are those of its motors.

    Raises:
        NaoGaitError: A joint of the description is none of the server's, or has no gains.
    """

    def __init__(self, server_robot: ServerRobot, robot: RobotDescription) -> None:
        unknown = [each for each in robot.joint_names if each not in server_robot.effectors]
        if unknown:
            allowed = f"those of the server's {server_robot.name}"
            raise NaoGaitError(f"joints of {robot.name}", ", ".join(unknown), allowed)
        self._effectors = [server_robot.effectors[each] for each in robot.joint_names]
        self._sensors = [server_robot.sensor(each) for each in robot.joint_names]
        self._gains = []
        for each in robot.joint_names:
            stiffness, damping = robot.motors[each].stiffness, robot.motors[each].damping
            if stiffness is None or damping is None:
                raise NaoGaitError(f"motor of {each}", "no stiffness", "stiffness and damping")
            self._gains.append((stiffness, damping))

    def frame(self, percepts: Percepts) -> SensorFrame:
        """The sensor frame of a cycle.

        Raises:
            NaoGaitError: A joint is missing.
        """
        missing = [each for each in self._sensors if each not in percepts.joints]
        if missing:
            raise NaoGaitError("joints", f"without {', '.join(missing)}", "all of the robot")
        return SensorFrame(
            stamp_of(percepts.time),
            np.array([percepts.joints[each] for each in self._sensors]),
            np.array(percepts.angular_velocity),
            np.array(percepts.linear_acceleration),
        )

    def motors(self, targets: JointTargets) -> dict[str, Motor]:
        """Commands of all motors by the server's names.

        The damping acts on the speed of the joint, not on its difference from that of the targets:
        in steps of 20 ms that shakes the robot. Stiffness is a share of the gains, since the server
        does not limit the torque otherwise.
        """
        shares = targets.joint_stiffness
        if shares is None:
            shares = np.full(len(targets.position), targets.stiffness)
        columns = zip(
            self._effectors, self._gains, targets.position.tolist(), shares.tolist(), strict=True
        )
        return {
            name: Motor(q, 0.0, share * kp, max(share, LIMP_SHARE) * kd, 0.0)
            for name, (kp, kd), q, share in columns
        }


def stamp_of(time: float) -> int:
    """Stamp [ns] of a cycle by the time [s] that the server tells, cut to `_TIME_STEP`."""
    return round((time + 0.5 * _TIME_STEP) / CYCLE) * _CYCLE_NS
