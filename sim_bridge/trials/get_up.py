"""A robot on the floor gets up by the gait's own means, stands, and walks: one attempt.

The robot lies on its front, its back or a side. Its joints move to a random pose with little torque
and go limp, so that every attempt begins in another pose: on a side some roll off it. Then the gait
starts.
"""

from dataclasses import dataclass, replace

import numpy as np

from robot_core.motion.keyframes import LYING, Motion
from robot_core.motion.library import MotionLibrary, shipped_library
from robot_core.robot import RobotDescription
from robot_core.types import STANDSTILL, FloatArray, GaitState, JointTargets, VelocityCommand
from sim_bridge.motors import TorqueLimits
from sim_bridge.robot import GroundTruth
from sim_bridge.trials.metrics import has_fallen
from sim_bridge.trials.trial import CONTROL_PERIOD, Trial, TrialSpec, loaded_robot
from sim_bridge.world import World

SIDES = {side: f"lying_{side}" for side in ("front", "back", "left", "right")}
"""Side -> start state of the simulation."""
WRIGGLE, LIMP = 0.5, 0.5
"""[s] for which the joints move to a random pose, and for which they are then limp."""
WRIGGLE_STIFFNESS, WRIGGLE_SPREAD = 0.3, 0.25
"""Share of the torque, and standard deviation [rad] around the stand pose."""
PATIENCE = 30.0
"""[s] after which a robot that is not up has failed."""
STAND, WALK = 2.0, 2.0
"""[s] for which it must stand, and then walk."""
FORWARD = VelocityCommand(0.10, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class GetUpSpec(TrialSpec):
    """Everything that an attempt depends on; the noise seed also draws the pose on the floor.

    Attributes:
        side: `front`, `back`, `left` or `right`.
    """

    side: str


@dataclass(frozen=True, slots=True)
class GetUpResult:
    """Result of an attempt.

    Attributes:
        spec: The specification.
        tries: Get-ups that the gait began until the robot stood. A roll over at the beginning is
            none.
        time: [s] from lying at rest to the gait's stand; None if it never stood.
        walked: It stood for `STAND` seconds after that, and walked for `WALK` seconds.
        torque_use: (n,) largest torque of each joint over what its motor has at standstill.
        speed_use: (n,) largest mean speed of each joint over a control period, over its limit.
        saturated: Share of the ticks with at least one motor at its limit.
    """

    spec: GetUpSpec
    tries: int
    time: float | None
    walked: bool
    torque_use: FloatArray
    speed_use: FloatArray
    saturated: float

    @property
    def at_once(self) -> bool:
        """Up and walking with the first try."""
        return self.walked and self.tries == 1


class _MotorUse:
    """Largest torques and speeds of the joints in one attempt."""

    def __init__(self, world: World) -> None:
        robot = world.robot.description
        limits = TorqueLimits(robot, world.robot.plant, world.robot.individual).standstill
        # A follower has no motor of its own; its torque is the leader's.
        self._torque_limit = np.where(limits > 0.0, limits, np.inf)
        self._speed_limit = robot.velocity_limit
        self._last: FloatArray | None = None
        self.torque = np.zeros(len(limits))
        self.speed = np.zeros(len(limits))
        self._ticks = self._saturated = 0

    def add(self, truth: GroundTruth) -> None:
        torque = np.abs(truth.joint_torque) / self._torque_limit
        np.maximum(self.torque, torque, out=self.torque)
        if self._last is not None:
            speed = np.abs(truth.joint_position - self._last) / CONTROL_PERIOD
            np.maximum(self.speed, speed / self._speed_limit, out=self.speed)
        self._last = truth.joint_position
        self._ticks += 1
        self._saturated += truth.torque_saturated > 0

    @property
    def saturated(self) -> float:
        return self._saturated / max(1, self._ticks)


def get_up(spec: GetUpSpec) -> GetUpResult:
    """Run one attempt, to its end or failure."""
    robot = loaded_robot(spec.urdf)
    pose = _random_pose(spec, robot)
    gets_up = replace(spec, parameters=spec.parameters.replace(get_up=True))
    wriggle = JointTargets(0, pose, WRIGGLE_STIFFNESS)
    with Trial(gets_up, action=wriggle, start_state=SIDES[spec.side]) as trial:
        use = _MotorUse(trial.world)
        # The gait answers the last frame of the limp robot.
        trial.advance(WRIGGLE - CONTROL_PERIOD)
        trial.action = JointTargets(0, pose, 0.0)
        trial.advance(LIMP)
        trial.action = STANDSTILL
        trial.step()
        tries, time = _get_up(trial, use, shipped_library(robot))
        up = time is not None and _stays_up(trial, use, STAND)
        walked = up and _stays_up(trial, use, WALK)
    return GetUpResult(spec, tries, time, walked, use.torque, use.speed, use.saturated)


def _get_up(trial: Trial, use: _MotorUse, library: MotionLibrary) -> tuple[int, float | None]:
    """Get-ups that the gait began, and the time [s] until it stood; None if it never did."""
    gait, begun = trial.gait, list[Motion]()
    start, before = trial.tick.truth.stamp, GaitState.STAND
    while True:
        now = gait.state
        if now is GaitState.GETTING_UP and before is not GaitState.GETTING_UP:
            begun.append(library.find(gait.status.motion))
        stands = now is GaitState.STAND and before is GaitState.GETTING_UP
        before = now
        use.add(trial.step().truth)
        time = (trial.tick.truth.stamp - start) * 1e-9
        if stands or time >= PATIENCE:
            rolled_first = bool(begun) and begun[0].ends in LYING
            return len(begun) - rolled_first, time if stands else None


def _stays_up(trial: Trial, use: _MotorUse, seconds: float) -> bool:
    """Whether it does not fall; its last frame is answered with the command to walk."""
    height = float(trial.tick.truth.torso_position[2])
    for left in range(round(seconds / CONTROL_PERIOD), 0, -1):
        if left == 1:
            trial.action = FORWARD
        truth = trial.step().truth
        use.add(truth)
        if has_fallen(truth.torso_position, truth.torso_quaternion, height):
            return False
    return True


def _random_pose(spec: GetUpSpec, robot: RobotDescription) -> FloatArray:
    """(n,) [rad] around the stand pose."""
    random = np.random.default_rng(
        [spec.robot_seed + 1, spec.noise_seed, sorted(SIDES).index(spec.side)]
    )
    pose = robot.stand_pose + random.normal(0.0, WRIGGLE_SPREAD, len(robot.joint_names))
    return np.clip(pose, robot.lower, robot.upper)
