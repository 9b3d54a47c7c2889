"""The replay of `nao_gait bench realtime` over ROS 2."""

from gait_lab.bench.ros_replay import replay_over_ros
from gait_lab.faults.harness import PERIOD
from gait_lab.faults.messages import Message
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput
from robot_core.robot import load_robot
from robot_core.types import GRAVITY

TICKS = 5
"""As many messages as the gait keeps of a topic while the machine holds it up."""
APART = 0.25
"""[s] of wall time between two ticks."""


def standing(tick: int) -> list[Message]:
    """The sensor messages of a robot that stands still."""
    robot = load_robot("nao_h21_v33")
    sec, nanosec = divmod(round((1.0 + tick * PERIOD) * 1e9), 1_000_000_000)
    imu = ImuInput(sec, nanosec, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY))
    names, pose = list(robot.joint_names), robot.stand_pose.tolist()
    return [
        Message("imu/data", imu),
        *(
            Message(f"{frame}/wrench", LoadInput(sec, nanosec, side, 25.0))
            for side, frame in enumerate(robot.sole_frames)
        ),
        Message("joint_states", JointInput(sec, nanosec, names, pose)),
    ]


def test_the_node_answers_every_joint_state_of_a_script() -> None:
    found = replay_over_ros([standing(tick) for tick in range(TICKS)], APART, {})
    assert len(found.sent) == len(found.answered) == TICKS
    pairs = zip(found.sent, found.answered, strict=True)
    assert all(answered is not None and answered > sent for sent, answered in pairs)
