"""Eq (7) on every joint that the second paper names, as far as the robot has it."""

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.whole_body.posture_feedback import PostureFeedback
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import GRAVITY, SensorFrame, VelocityCommand

DT = 0.01
BRUNO, NAO = load_robot("bruno"), load_robot("nao_h21_v33")
GAINS = GaitParameters(gyro_pitch_gain=0.02, gyro_roll_gain=-0.05)
EVERYWHERE = {"derivative_time": 0.04, "hip": 0.5, "waist": 2.0, "shoulder": -3.0}
RATE, NEXT = (0.3, -0.2, 0.7), (0.5, 0.1, 0.7)
ROLL = -0.05 * (0.5 + 0.04 * 0.2 / DT)
PITCH = 0.02 * (0.1 + 0.04 * 0.3 / DT)


def corrections(robot: RobotDescription, support: int, **settings: float) -> dict[str, float]:
    """Joint -> correction of the second tick."""
    feedback = PostureFeedback(robot, **settings)
    feedback.apply(np.zeros(len(robot.joint_names)), support, RATE, GAINS, DT)
    position = np.zeros(len(robot.joint_names))
    feedback.apply(position, support, NEXT, GAINS, DT)
    named = zip(robot.joint_names, position.tolist(), strict=True)
    return {name: value for name, value in named if value != 0.0}


@pytest.mark.parametrize(("support", "side"), [(1, "L"), (-1, "R")])
def test_every_named_joint_gets_its_share(support: int, side: str) -> None:
    assert corrections(BRUNO, support, **EVERYWHERE) == pytest.approx(
        {
            f"{side}AnklePitch": PITCH,
            f"{side}AnkleRoll": ROLL,
            f"{side}HipPitch": 0.5 * PITCH,
            f"{side}HipRoll": 0.5 * ROLL,
            "WaistPitch": 2.0 * PITCH,
            "LShoulderPitch": -3.0 * PITCH,
            "RShoulderPitch": -3.0 * PITCH,
            "LShoulderRoll": -3.0 * ROLL,
            "RShoulderRoll": -3.0 * ROLL,
        }
    )


def test_a_robot_without_a_waist_has_all_other_corrections() -> None:
    bruno, nao = corrections(BRUNO, 1, **EVERYWHERE), corrections(NAO, 1, **EVERYWHERE)
    assert nao == {name: value for name, value in bruno.items() if name != "WaistPitch"}


def test_only_the_support_ankle_by_default() -> None:
    assert set(corrections(BRUNO, -1)) == {"RAnklePitch", "RAnkleRoll"}


def test_a_forward_fall_is_corrected_against_its_direction() -> None:
    feedback, position = PostureFeedback(BRUNO, hip=1.0), np.zeros(len(BRUNO.joint_names))
    feedback.apply(position, 1, (0.0, 1.0, 0.0), GAINS, DT)
    # Both angles turn what is above them back, as seen from the foot that stands.
    assert position[BRUNO.index("LAnklePitch")] > 0.0
    assert position[BRUNO.index("LHipPitch")] > 0.0


@pytest.mark.parametrize("walk", ["lipm", "zmp"])
def test_it_acts_in_both_walks_and_only_with_feedback(walk: str) -> None:
    waist = {}
    for feedback in (True, False):
        gait = Gait(BRUNO, GaitParameters(walk=walk, feedback=feedback))
        gait._posture = PostureFeedback(BRUNO, waist=1.0)
        for i in range(200):
            frame = SensorFrame(
                stamp=round((i + 1) * DT * 1e9),
                joint_position=np.array(BRUNO.stand_pose),
                angular_velocity=np.array((0.0, 0.3, 0.0)) if i > 190 else np.zeros(3),
                linear_acceleration=np.array((0.0, 0.0, GRAVITY)),
            )
            targets = gait.step(frame, VelocityCommand(0.05))
        waist[feedback] = targets.position[BRUNO.index("WaistPitch")]
    assert waist[True] == pytest.approx(0.02 * 0.3)
    assert waist[False] == 0.0
