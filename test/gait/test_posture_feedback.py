"""Eq (7) of the second paper, on the ankle of the supporting leg."""

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.whole_body.posture_feedback import PostureFeedback
from robot_core.robot import load_robot
from robot_core.types import GRAVITY, SensorFrame, VelocityCommand

DT = 0.01
BRUNO = load_robot("bruno")
GAINS = GaitParameters(gyro_pitch_gain=0.02, gyro_roll_gain=-0.05)
RATE = (0.5, 0.1, 0.7)


def corrections(support: int) -> dict[str, float]:
    """Joint -> correction by a measurement, and again without a new one."""
    feedback, position = PostureFeedback(BRUNO), np.zeros((2, len(BRUNO.joint_names)))
    feedback.apply(position[0], support, RATE, GAINS)
    feedback.apply(position[1], support, None, GAINS)
    assert (position[0] == position[1]).all()
    named = zip(BRUNO.joint_names, position[0].tolist(), strict=True)
    return {name: value for name, value in named if value != 0.0}


@pytest.mark.parametrize(("support", "side"), [(1, "L"), (-1, "R")])
def test_the_support_ankle_turns_with_the_torso(support: int, side: str) -> None:
    # A toe that is pressed down turns what is above it back.
    pitch, roll = 0.02 * 0.1, -0.05 * 0.5
    assert corrections(support) == {
        f"{side}AnklePitch": pytest.approx(pitch), f"{side}AnkleRoll": pytest.approx(roll)
    }  # fmt: skip


@pytest.mark.parametrize("walk", ["lipm", "zmp"])
@pytest.mark.parametrize("feedback", [True, False])
def test_it_acts_in_both_walks_and_only_with_feedback(walk: str, feedback: bool) -> None:
    sent = []
    for gain in (0.0, 0.02):
        parameters = GaitParameters(walk=walk, feedback=feedback, gyro_pitch_gain=gain)
        gait = Gait(BRUNO, parameters)
        for i in range(200):
            frame = SensorFrame(
                stamp=round((i + 1) * DT * 1e9),
                joint_position=np.array(BRUNO.stand_pose),
                angular_velocity=np.array((0.0, 0.3, 0.0)) if i > 190 else np.zeros(3),
                linear_acceleration=np.array((0.0, 0.0, GRAVITY)),
            )
            targets = gait.step(frame, VelocityCommand(0.05))
        sent.append(targets.position)
    named = zip(BRUNO.joint_names, (sent[1] - sent[0]).tolist(), strict=True)
    changed = {name[1:]: value for name, value in named if abs(value) > 1e-9}
    assert changed == ({"AnklePitch": pytest.approx(0.02 * 0.3)} if feedback else {})
