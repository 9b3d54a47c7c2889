"""A standing robot kicks a ball: one attempt, in one process."""

import math
from dataclasses import dataclass, field

import numpy as np

from gait_lab.analysis.metrics import has_fallen, yaw_of
from gait_lab.trials.ball_spot import spot_in_world
from gait_lab.trials.rollout import CONTROL_PERIOD, loaded_robot
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.motion.library import shipped_library
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import STANDSTILL, FloatArray, GaitState, JointTargets
from sim_bridge.ball import Ball
from sim_bridge.plant import PlantOption, load_plant, with_options
from sim_bridge.simulation import Simulation

SETTLE = 1.5
"""[s] of standing before the ball is laid."""
AFTERWARDS = 2.0
"""[s] for which the robot has to stand after the kick."""
PLACEMENT = 0.005
"""[m] standard deviation of where the ball is laid, in x and in y."""
STOPPED, PATIENCE = 0.01, 8.0
"""[m/s] below which the ball lies, and [s] after the kick for which it may roll."""
OUT_OF_THE_WAY = (-5.0, 5.0)


@dataclass(frozen=True, slots=True)
class KickSpec:
    """Everything that an attempt depends on."""

    motion: str
    robot_seed: int = 0
    attempt: int = 0
    """Seed of where the ball is laid, and of the sensor noise."""
    parameters: GaitParameters = field(default_factory=GaitParameters)
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    urdf: str = "nao_h21_v33"
    engine: str = "pybullet"


@dataclass(frozen=True, slots=True)
class KickResult:
    spec: KickSpec
    distance: float
    """[m] from where the ball lay to where it came to rest."""
    direction: float
    """[rad] in which it went, counter-clockwise from the robot's heading before the kick."""
    speed: float
    """[m/s] largest of the ball."""
    stood: bool
    """The robot stands after it."""
    seconds: float
    """[s] from the request to the stand of the gait."""


def kick(spec: KickSpec) -> KickResult:
    """One attempt."""
    robot = loaded_robot(spec.urdf)
    simulation = Simulation(
        robot,
        with_options(load_plant(spec.plant), spec.plant_options),
        robot_seed=spec.robot_seed,
        noise_seed=spec.attempt,
        engine=spec.engine,
        control_period=CONTROL_PERIOD,
        ball=Ball(*OUT_OF_THE_WAY),
    )
    try:
        return _attempt(spec, simulation, Gait(robot, spec.parameters))
    finally:
        simulation.close()


def _attempt(spec: KickSpec, simulation: Simulation, gait: Gait) -> KickResult:
    motion = shipped_library(simulation.robot).find(spec.motion)
    if motion.kick is None:
        raise ValueError(f"{spec.motion} is no kick")
    targets: JointTargets | None = None
    height = float(simulation.truth().torso_position[2])
    up = True

    def tick() -> None:
        nonlocal targets, up
        simulation.step(targets)
        frame = simulation.sense()
        if frame is not None:
            targets = gait.step(frame, STANDSTILL)
        truth = simulation.truth()
        up = up and not has_fallen(truth.torso_position, truth.torso_quaternion, height)

    for _ in range(round(SETTLE / CONTROL_PERIOD)):
        tick()
    heading, lay = _lay_ball(spec, simulation, (motion.kick.x, motion.kick.y))
    gait.request_motion(spec.motion)
    tick()
    ticks, fastest = 1, 0.0
    while gait.state is GaitState.MOTION and up:
        tick()
        ticks += 1
        fastest = max(fastest, _speed(simulation))
    stood_at, waited = ticks, 0.0
    while waited < PATIENCE and (waited < AFTERWARDS or _speed(simulation) > STOPPED):
        tick()
        waited += CONTROL_PERIOD
        fastest = max(fastest, _speed(simulation))
        if not up and waited > AFTERWARDS:
            break
    ball = simulation.ball
    gone = np.zeros(2) if ball is None else ball.position[:2] - lay
    direction = math.remainder(math.atan2(gone[1], gone[0]) - heading, math.tau)
    return KickResult(
        spec, float(np.hypot(*gone)), direction, fastest, up, stood_at * CONTROL_PERIOD
    )


def _lay_ball(
    spec: KickSpec, simulation: Simulation, spot: tuple[float, float]
) -> tuple[float, FloatArray]:
    """Heading [rad] of the robot, and where the ball lies (2,) [m] in the world."""
    truth = simulation.truth()
    rng = np.random.default_rng([spec.robot_seed + 1, spec.attempt])
    x, y = np.array(spot) + rng.normal(0.0, PLACEMENT, 2)
    lay = spot_in_world(truth, float(x), float(y))
    simulation.put_ball(float(lay[0]), float(lay[1]))
    return float(yaw_of(truth.torso_quaternion)), lay


def _speed(simulation: Simulation) -> float:
    ball = simulation.ball
    return 0.0 if ball is None else float(np.hypot(*ball.velocity[:2]))
