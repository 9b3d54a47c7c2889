"""A robot on the floor gets up by the gait's own means, stands, and walks: one attempt.

Physics and gait in one process, as in `rollout`. The robot is laid on its front or back, its joints
move at random with little torque, so that no attempt begins like another, and go limp.
"""

from dataclasses import dataclass, field

import numpy as np

from gait_lab.analysis.metrics import has_fallen
from gait_lab.trials.rollout import CONTROL_PERIOD, loaded_robot, with_urdf_effort
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import (
    STANDSTILL,
    FloatArray,
    GaitState,
    JointTargets,
    VelocityCommand,
)
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import PlantOption, load_plant, with_options
from sim_bridge.simulation import GroundTruth, Simulation

SIDES = {"front": "lying_front", "back": "lying_back"}
"""Side -> start state of the simulation."""
WRIGGLE, LIMP = 0.5, 0.5
"""[s] for which the joints move at random, and for which they then hang."""
WRIGGLE_STIFFNESS, WRIGGLE_SPREAD = 0.3, 0.25
"""Share of the torque, and standard deviation [rad] around the stand pose."""
PATIENCE = 30.0
"""[s] after which a robot that is not up has failed."""
STAND, WALK = 2.0, 2.0
"""[s] for which it must stand, and then walk."""
FORWARD = VelocityCommand(0.10, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class GetUpSpec:
    """Everything that an attempt depends on."""

    side: str
    """`front` or `back`."""
    robot_seed: int = 0
    attempt: int = 0
    """Seed of the pose in which it lies, and of the sensor noise."""
    parameters: GaitParameters = field(default_factory=GaitParameters)
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    urdf: str = "nao_h21_v33"
    engine: str = "pybullet"
    urdf_effort: bool = False
    """Motors whose stall torque is the effort limit of the URDF, instead of their own."""


@dataclass(frozen=True, slots=True)
class GetUpResult:
    spec: GetUpSpec
    tries: int
    """Get-ups that the gait began until the robot stood."""
    time: float | None
    """[s] from lying at rest to the gait's stand; None = it never stood."""
    stood: bool
    """It stood for `STAND` seconds after that."""
    walked: bool
    """And walked for `WALK` seconds."""
    torque_use: FloatArray
    """(n,) largest torque of each joint over what its motor has at standstill."""
    speed_use: FloatArray
    """(n,) largest mean speed of each joint over a control period, over its limit."""
    saturated: float
    """Share of the ticks with at least one motor at its limit."""

    @property
    def at_once(self) -> bool:
        """Up and walking with the first try."""
        return self.walked and self.tries == 1


class _Watch:
    """Torques and speeds of one attempt."""

    def __init__(self, simulation: Simulation) -> None:
        robot = simulation.robot
        limits = TorqueLimits(robot, simulation.plant, simulation.individual).standstill
        # A follower has no motor of its own; its torque is the leader's.
        self._torque_limit = np.where(limits > 0.0, limits, np.inf)
        self._speed_limit = robot.velocity_limit
        self._last: FloatArray | None = None
        self.torque_use = np.zeros(len(limits))
        self.speed_use = np.zeros(len(limits))
        self._ticks = self._saturated = 0

    def see(self, truth: GroundTruth) -> None:
        np.maximum(
            self.torque_use, np.abs(truth.joint_torque) / self._torque_limit, out=self.torque_use
        )
        if self._last is not None:
            speed = np.abs(truth.joint_position - self._last) / CONTROL_PERIOD
            np.maximum(self.speed_use, speed / self._speed_limit, out=self.speed_use)
        self._last = truth.joint_position
        self._ticks += 1
        self._saturated += truth.torque_saturated > 0

    @property
    def saturated(self) -> float:
        return self._saturated / max(1, self._ticks)


def get_up(spec: GetUpSpec) -> GetUpResult:
    """One attempt, to its end or failure."""
    robot = loaded_robot(spec.urdf)
    simulation = Simulation(
        with_urdf_effort(robot) if spec.urdf_effort else robot,
        with_options(load_plant(spec.plant), spec.plant_options),
        robot_seed=spec.robot_seed,
        noise_seed=spec.attempt,
        engine=spec.engine,
        control_period=CONTROL_PERIOD,
        start_state=SIDES[spec.side],
    )
    try:
        return _attempt(spec, simulation, Gait(robot, spec.parameters.replace(get_up=True)))
    finally:
        simulation.close()


def _attempt(spec: GetUpSpec, simulation: Simulation, gait: Gait) -> GetUpResult:
    _lie_somehow(simulation, spec)
    watch = _Watch(simulation)
    state = _Runner(simulation, gait, watch)
    tries = 0
    before = GaitState.STAND
    time: float | None = None
    while state.time < PATIENCE:
        now = state.tick(STANDSTILL)
        tries += now is GaitState.GETTING_UP and before is not GaitState.GETTING_UP
        if now is GaitState.STAND and before is GaitState.GETTING_UP:
            time = state.time
            break
        before = now
    stood = time is not None and state.stays_up(STANDSTILL, STAND)
    walked = stood and state.stays_up(FORWARD, WALK)
    return GetUpResult(
        spec, tries, time, stood, walked, watch.torque_use, watch.speed_use, watch.saturated
    )


class _Runner:
    """Ticks of one attempt, from the moment in which the robot lies at rest."""

    def __init__(self, simulation: Simulation, gait: Gait, watch: _Watch) -> None:
        self._simulation, self._gait, self._watch = simulation, gait, watch
        self._targets: JointTargets | None = None
        self._began = simulation.time

    @property
    def time(self) -> float:
        """[s]"""
        return (self._simulation.time - self._began) * 1e-9

    def tick(self, command: VelocityCommand) -> GaitState:
        frame = self._simulation.sense()
        if frame is not None:
            self._targets = self._gait.step(frame, command)
        self._simulation.step(self._targets)
        self._watch.see(self._simulation.truth())
        return self._gait.state

    def stays_up(self, command: VelocityCommand, seconds: float) -> bool:
        height = float(self._simulation.truth().torso_position[2])
        for _ in range(round(seconds / CONTROL_PERIOD)):
            self.tick(command)
            truth = self._simulation.truth()
            if has_fallen(truth.torso_position, truth.torso_quaternion, height):
                return False
        return True


def _lie_somehow(simulation: Simulation, spec: GetUpSpec) -> None:
    robot = simulation.robot
    rng = np.random.default_rng([spec.robot_seed + 1, spec.attempt, sorted(SIDES).index(spec.side)])
    pose = robot.stand_pose + rng.normal(0.0, WRIGGLE_SPREAD, len(robot.joint_names))
    pose = np.clip(pose, robot.lower, robot.upper)
    for seconds, stiffness in ((WRIGGLE, WRIGGLE_STIFFNESS), (LIMP, 0.0)):
        for _ in range(round(seconds / CONTROL_PERIOD)):
            simulation.step(JointTargets(0, pose, stiffness))
