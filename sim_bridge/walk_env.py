"""The Gymnasium environment `nao_lipm_gait/Walk-v0`: learn on top of the gait."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from robot_core.errors import NaoGaitError
from robot_core.geometry import relative
from robot_core.message_checks import read_array
from robot_core.schema import Number, Optional
from robot_core.types import STANDSTILL, FloatArray, JointTargets, Pose2, VelocityCommand
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant
from sim_bridge.simulation import Observation, Simulation
from sim_bridge.trials.trial import CONTROL_PERIOD, loaded_robot

STAND_TIME = 1.0
"""[s] of standing at the start of an episode."""
SPEED_MAX = 10.0
"""[m/s, rad/s] of a command, as over ROS: degrees are beyond."""


class WalkEnv(gymnasium.Env[FloatArray, FloatArray]):
    """A robot that its gait makes walk; the action is added to the gait's joint targets.

    Action: (n,) from -1 to 1, times `residual` [rad], added to the joint targets; what results is
    clipped at the joint limits. Zero walks exactly as the gait does.

    Observation: (2n + 9,) what a real robot has, no ground truth: joint angles (n,) [rad], angular
    velocity (3,) [rad/s] and specific force (3,) [m/s^2] in the torso frame, all as old as the
    sensor delay; the targets of the gait (n,) [rad] that the next action is added to; commanded
    velocity (3,) [m/s, m/s, rad/s].

    Reward, from ground truth: way of base_footprint along the commanded velocity in this step [m;
    rad for a turn on the spot], minus `effort` times the mean squared action, minus 1 at a fall. A
    fall terminates the episode; 1,000 steps (10 s) truncate it.

    `reset(seed=S)` draws the individual robot; `options={"individual": N}` chooses it. `info` has
    its number, `individual`.

    Args:
        robot: Shipped name of the robot, or its URDF, MJCF or robot file.
        engine: `mujoco` or `pybullet`.
        plant: A plant, or its name or file.
        parameters: Parameters of the gait, or the name or file of a preset.
        velocity: Commanded x, y, yaw [m/s, m/s, rad/s] after a second of standing.
        residual: [rad] largest change of a joint target.
        effort: Cost of the mean squared action in each step.
        individuals: Number of individuals to draw from: robots 0 to this minus 1.
    """

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        robot: str = "nao_h21_v33",
        engine: str = "mujoco",
        plant: str | Plant = "reference",
        parameters: GaitParameters | str = "default",
        velocity: tuple[float, float, float] = (0.2, 0.0, 0.0),
        residual: float = 0.1,
        effort: float = 0.0001,
        individuals: int = 40,
    ) -> None:
        self._residual = Number(0.0, 3.14, "rad").check("residual", residual)
        self._effort = Number(0.0, 1e6).check("effort", effort)
        self._individuals = int(Number(1, 2**62, whole=True).check("individuals", individuals))
        speeds = read_array(velocity, "velocity", (3,), SPEED_MAX, "m/s, m/s, rad/s")
        self._velocity = VelocityCommand(*speeds.tolist())
        self._robot = loaded_robot(str(robot))
        self._parameters = Gait(self._robot, parameters).parameters
        self._base: JointTargets | None = None
        self._simulation = Simulation(robot, engine=engine, plant=plant)
        n = len(self._robot.joint_names)
        self.action_space = Box(-1.0, 1.0, (n,), np.float64)
        self.observation_space = Box(-np.inf, np.inf, (2 * n + 9,), np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode; the robot stands and its first frame has passed the sensor delay."""
        super().reset(seed=Optional(Number(0, whole=True)).check("seed", seed))
        options = {} if options is None else options
        if not isinstance(options, Mapping):
            raise NaoGaitError("options", options, "a mapping of individual")
        for name in options:
            if name != "individual":
                raise NaoGaitError(f"options.{name}", options[name], ("individual",))
        drawn = int(self.np_random.integers(self._individuals))
        whole = Number(NOMINAL, whole=True)
        individual = int(whole.check("options.individual", options.get("individual", drawn)))
        self._gait = Gait(self._robot, self._parameters)
        seen = self._simulation.reset(individual)
        while seen.frame is None:
            seen = self._simulation.step(None)
        self._before = seen.truth.base_footprint
        self._individual = individual
        return self._answered(seen), {"individual": individual}

    def step(
        self, action: FloatArray
    ) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """One control period; see the class."""
        base = self._base
        if base is None:
            raise NaoGaitError("step", "no reset before it", "step after reset")
        action = read_array(action, "action", (len(base.position),), 1.0)
        position = base.position + self._residual * action
        position = np.clip(position, self._robot.lower, self._robot.upper)
        seen = self._simulation.step(base._replace(position=position))
        reward = self._way(seen) - self._effort * float(np.mean(action**2)) - float(seen.fallen)
        info = {"individual": self._individual}
        return self._answered(seen), reward, seen.fallen, False, info

    def _answered(self, seen: Observation) -> FloatArray:
        """The observation, with the answer of the gait to the newest frame."""
        frame = seen.frame
        assert frame is not None
        stands = seen.time < STAND_TIME + 0.5 * CONTROL_PERIOD
        command = STANDSTILL if stands else self._velocity
        self._base = base = self._gait.step(frame, command)
        return np.concatenate((
            frame.joint_position, frame.angular_velocity, frame.linear_acceleration,
            base.position, command,
        ))  # fmt: skip

    def _way(self, seen: Observation) -> float:
        """Way along the commanded velocity since the last step, in the robot's heading."""
        before, self._before = self._before, seen.truth.base_footprint
        moved: Pose2 = relative(self._before, before)
        x, y, yaw = self._velocity
        speed = float(np.hypot(x, y))
        if speed > 0.0:
            return (moved[0] * x + moved[1] * y) / speed
        return moved[2] * float(np.sign(yaw))

    def close(self) -> None:
        """Free the engine."""
        self._simulation.close()
