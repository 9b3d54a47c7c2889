"""Eq (7) on every joint that the second paper names, as far as the robot has it."""

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.whole_body.posture_feedback import PostureFeedback
from robot_core.robot import load_robot
from robot_core.types import GRAVITY, SensorFrame, VelocityCommand

DT = 0.01
BRUNO, NAO = load_robot("bruno"), load_robot("nao_h21_v33")
GAINS = GaitParameters(
    gyro_pitch_gain=0.02,
    gyro_pitch_rate_gain=0.001,
    gyro_roll_gain=0.05,
    gyro_roll_rate_gain=-0.002,
    gyro_hip_share=0.5,
    gyro_waist_share=2.0,
    gyro_shoulder_share=-3.0,
)
RATE, NEXT = (0.3, -0.2, 0.7), (0.5, 0.1, 0.7)
ROLL = 0.05 * 0.5 - 0.002 * 0.2 / DT
PITCH = 0.02 * 0.1 + 0.001 * 0.3 / DT


def corrections(robot_name: str, support: int, parameters: GaitParameters) -> dict[str, float]:
    """Joint -> correction of the second tick."""
    robot = {"bruno": BRUNO, "nao": NAO}[robot_name]
    feedback = PostureFeedback(robot)
    feedback.apply(np.zeros(len(robot.joint_names)), support, RATE, parameters, DT)
    position = np.zeros(len(robot.joint_names))
    feedback.apply(position, support, NEXT, parameters, DT)
    named = zip(robot.joint_names, position.tolist(), strict=True)
    return {name: value for name, value in named if value != 0.0}


@pytest.mark.parametrize(("support", "side"), [(1, "L"), (-1, "R")])
def test_every_named_joint_gets_its_share(support: int, side: str) -> None:
    assert corrections("bruno", support, GAINS) == pytest.approx(
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
    bruno, nao = corrections("bruno", 1, GAINS), corrections("nao", 1, GAINS)
    assert nao == {name: value for name, value in bruno.items() if name != "WaistPitch"}


def test_only_the_support_ankle_by_default() -> None:
    assert set(corrections("bruno", -1, GaitParameters())) == {"RAnklePitch", "RAnkleRoll"}


def test_a_forward_fall_is_corrected_against_its_direction() -> None:
    falling = GaitParameters(gyro_pitch_gain=0.02, gyro_hip_share=1.0)
    feedback, position = PostureFeedback(BRUNO), np.zeros(len(BRUNO.joint_names))
    feedback.apply(position, 1, (0.0, 1.0, 0.0), falling, DT)
    # Both angles turn what is above them back, as seen from the foot that stands.
    assert position[BRUNO.index("LAnklePitch")] > 0.0
    assert position[BRUNO.index("LHipPitch")] > 0.0


@pytest.mark.parametrize("walk", ["lipm", "zmp"])
def test_it_acts_in_both_walks_and_only_with_feedback(walk: str) -> None:
    parameters = GaitParameters(walk=walk, gyro_waist_share=1.0)
    waist = {}
    for feedback in (True, False):
        gait = Gait(BRUNO, parameters.replace(feedback=feedback))
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
