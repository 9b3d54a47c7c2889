"""The CoM of the whole body reaches its target in few iterations."""

import math

import numpy as np
import pytest

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.base import BodyTargets
from nao_lipm_gait.walks.lipm.walk import LipmWalk
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from nao_lipm_gait.whole_body.com_placement import COM_TOLERANCE, ComPlacement
from nao_lipm_gait.whole_body.leg_kinematics import LegSolution
from nao_lipm_gait.whole_body.legs import make_legs
from nao_lipm_gait.whole_body.shared_hip_legs import YAW_TOLERANCE
from robot_core.geometry import rotation_from_rpy
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray, VelocityCommand

COMMANDS = (VelocityCommand(x=0.3), VelocityCommand(y=0.12), VelocityCommand(yaw=1.2))
DT = 0.01


class CountedLegs:
    """Leg kinematics that count their calls."""

    def __init__(self, robot: RobotDescription) -> None:
        self._legs = make_legs(robot)
        self.calls = 0

    def solve(self, left: SolePose, right: SolePose, *, again: bool = False) -> LegSolution:
        self.calls += 1
        return self._legs.solve(left, right, again=again)


def targets_of(command: VelocityCommand, ticks: int) -> list[BodyTargets]:
    walk = LipmWalk(GaitParameters(feedback=False), DT)
    walk.start(command)
    found = []
    for _ in range(ticks):
        walk.expect()
        found.append(walk.plan(command))
    return found


def com_in_q(body: BodyModel, joints: FloatArray, targets: BodyTargets) -> FloatArray:
    """CoM (3,) in Q [m] by the joints alone, if the left sole is at its target."""
    com = np.array(body.set_joints(joints))
    sole = body.sole_in_torso(1)
    forward, normal = np.array(sole.forward), np.array(sole.normal)
    in_torso = np.column_stack((forward, np.cross(normal, forward), normal))
    wanted = targets.left_sole
    in_q = np.array(rotation_from_rpy(wanted.roll, wanted.pitch, wanted.yaw))
    place = np.array((wanted.x, wanted.y, wanted.z))
    return place + in_q @ in_torso.T @ (com - np.array(sole.position))


@pytest.mark.parametrize("command", COMMANDS)
def test_the_com_reaches_its_target_mostly_in_one_iteration(command: VelocityCommand) -> None:
    robot = load_robot()
    legs, body = CountedLegs(robot), BodyModel(robot)
    placement = ComPlacement(robot, BodyModel(robot), legs)
    walk = targets_of(command, 400)
    for targets in walk[:200]:
        placement.place(targets)
    legs.calls, misses, turns = 0, [], []
    for targets in walk[200:]:
        joints = placement.place(targets).position
        misses.append(np.abs(com_in_q(body, joints, targets) - targets.com_in_q).max())
        body.set_joints(joints)
        left, right = (np.array(body.sole_in_torso(side).forward) for side in (1, -1))
        normal = body.sole_in_torso(1).normal
        turn = math.atan2(float(normal @ np.cross(right, left)), float(right @ left))
        turns.append(abs(turn - (targets.left_sole.yaw - targets.right_sole.yaw)))
    # A sole's own yaw error, at most half of the tolerance, turns the CoM about the sole.
    assert max(misses) < 1.5 * COM_TOLERANCE
    assert np.median(turns) < 5.0 * YAW_TOLERANCE
    assert legs.calls < 1.5 * len(misses)


def test_arms_swing_with_the_feet_and_not_with_a_turn_on_the_spot() -> None:
    robot = load_robot()
    shoulders = [robot.index(name) for name in robot.shoulder_pitch]

    def swing(command: VelocityCommand) -> FloatArray:
        placement = ComPlacement(robot, BodyModel(robot), make_legs(robot))
        walk = targets_of(command, 300)
        placed = [placement.place(targets, arm_swing=4.0).position[shoulders] for targets in walk]
        return np.array(placed[100:]) - np.array(robot.stand_pose)[shoulders]

    straight, turn = (swing(VelocityCommand(x=0.3)), swing(VelocityCommand(yaw=1.2)))
    assert np.ptp(straight) > 0.4
    assert np.allclose(straight[:, 0], -straight[:, 1])
    assert np.ptp(turn) < 0.05
