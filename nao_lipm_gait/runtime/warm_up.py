"""The first tick pays for caches and late imports; a gait that nobody listens to pays instead."""

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.controller import GaitController, Settings
from nao_lipm_gait.runtime.inputs import ImuInput, Input, JointInput, TwistInput
from nao_lipm_gait.runtime.outlet import DeafOutlet
from nao_lipm_gait.types import GRAVITY

STANDS, WALKS = 2, 60
"""Ticks with a stand time of nearly nothing."""


def warm_up(robot: RobotDescription, parameters: GaitParameters, settings: Settings) -> None:
    """Stand and walk for a moment; nothing of it is kept."""
    quick = parameters.replace(stand_time=0.05)
    entry = GaitController(robot, quick, settings, DeafOutlet(), lambda: 0.0)
    names, pose = list(robot.joint_names), robot.stand_pose.tolist()
    period = round(settings.control_period * 1e9)

    def take(topic: str, message: Input) -> None:
        entry.receive(topic, lambda: message)

    for tick in range(1, STANDS + WALKS):
        sec, nanosec = divmod(tick * period, 1_000_000_000)
        take("imu/data", ImuInput(sec, nanosec, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY)))
        take("joint_states", JointInput(sec, nanosec, names, pose, []))
        if tick == STANDS:
            take("cmd_vel", TwistInput((0.1, 0.0, 0.0), (0.0, 0.0, 0.0)))
