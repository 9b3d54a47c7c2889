"""Keeps slow things off the tick: the first ticks' warm-up and Python's garbage collection."""

import gc

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController
from nao_lipm_gait.runtime.inputs import ImuInput, Input, JointInput, TwistInput
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY

WARM_UP_STANDS, WARM_UP_WALKS = 2, 60
"""Ticks of the warm-up, with a stand time of nearly nothing."""
COLLECT_RESTING = 2_000
"""Container objects made since the last collection, after which a resting gait collects all."""
COLLECT_WALKING = 20_000
"""The same for a walking gait, which collects only the young ones: about a millisecond."""


def warm_up(
    robot: RobotDescription, parameters: GaitParameters, settings: ControllerSettings
) -> None:
    """Let a gait of the same kind stand and walk for a moment, and drop it.

    The first ticks are slow, because they fill caches and import modules.
    """
    quick = parameters.replace(stand_time=0.05)
    controller = GaitController(robot, quick, settings, lambda: 0.0)
    names, pose = list(robot.joint_names), robot.stand_pose.tolist()
    period = round(settings.control_period * 1e9)

    def receive(topic: str, message: Input) -> None:
        controller.receive(topic, lambda: message)

    for tick in range(1, WARM_UP_STANDS + WARM_UP_WALKS):
        sec, nanosec = divmod(tick * period, 1_000_000_000)
        receive("imu/data", ImuInput(sec, nanosec, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY)))
        receive("joint_states", JointInput(sec, nanosec, names, pose))
        if tick == WARM_UP_STANDS:
            receive("cmd_vel", TwistInput((0.1, 0.0, 0.0), (0.0, 0.0, 0.0)))


class GarbageScheduler:
    """Replaces Python's automatic collector, which takes some milliseconds at any moment.

    It collects right after an answer was sent, and everything only while the robot rests.

    Attributes:
        collections: Collections of either kind, since the start.
    """

    def __init__(self) -> None:
        self.collections = 0
        gc.disable()

    def after_tick(self, resting: bool) -> None:
        """Collect if there is enough to collect; to be called after an answer was sent."""
        made = gc.get_count()[0]
        if made > (COLLECT_RESTING if resting else COLLECT_WALKING):
            gc.collect() if resting else gc.collect(0)
            self.collections += 1

    def close(self) -> None:
        """Switch the automatic collector on again."""
        gc.enable()
