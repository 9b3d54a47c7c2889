"""Keeps slow things off the tick: the first ticks' warm-up and Python's garbage collection."""

import gc

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController, Output
from nao_lipm_gait.runtime.inputs import ImuInput, Input, JointInput, TwistInput
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, WALK

WARM_UP_WALKS, WARM_UP_MAX = 60, 500
"""Ticks of the warm-up: those of the walk that follows a stand, and at most."""
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
    controller = GaitController(robot, parameters, settings, lambda: 0.0)
    names, pose = list(robot.joint_names), robot.stand_pose.tolist()
    period = round(settings.control_period * 1e9)

    def receive(topic: str, message: Input) -> Output:
        return controller.receive(topic, lambda: message)

    walked = 0
    for tick in range(1, WARM_UP_MAX):
        sec, nanosec = divmod(tick * period, 1_000_000_000)
        rate = 1e-3 * (-1) ** tick  # an IMU that always shows the same would count as broken
        receive("imu/data", ImuInput(sec, nanosec, (rate, rate, 0.0), (rate, rate, GRAVITY)))
        for answer in receive("joint_states", JointInput(sec, nanosec, names, pose)).answers:
            pose = answer.targets.position.tolist()
        receive("cmd_vel", TwistInput((0.1, 0.0, 0.0), (0.0, 0.0, 0.0)))
        walked += controller.state is WALK
        if walked >= WARM_UP_WALKS:
            return


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
