"""A learned walk in the gait's place, on our plant.

It observes what the sensors give that the gait has too, with their noise and delay: gravity by the
gait's complementary filter, joint velocities by differences of angles. The velocity of the torso,
which no robot measures, is that over the lower sole, or the true one if it is asked for.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.peers.player import peer_status
from gait_lab.peers.policy_file import VELOCITY, Policy, load_policy
from nao_lipm_gait.estimation.torso_orientation import TorsoOrientation
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.geometry import as_point, dot
from robot_core.robot import RobotDescription
from robot_core.types import (
    LEFT,
    RIGHT,
    FloatArray,
    GaitState,
    JointTargets,
    SensorFrame,
    VelocityCommand,
)
from sim_bridge.robot import GroundTruth
from sim_bridge.trials.tasks import Task

HOW_TO_GET_IT = "pip install 'nao_lipm_gait[policy]'"
GRAVITY_TIME = 1.0
"""[s] of the correction of gravity by the accelerometer: less than the gait's, which has measured
the bias of its gyro."""
VELOCITY_TIME = 0.02
"""[s] Smoothing of the velocity over the lower sole; more of it comes too late."""
LOWER = 0.01
"""[m] by which a sole has to be below the other one to become the support, of a robot of size 1."""
Network = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True)
class PolicyWalk:
    """Makes walkers of a policy; small and picklable.

    Attributes:
        path: File of the policy.
        true_velocity: It sees the true velocity of the torso.
    """

    path: str
    true_velocity: bool = False

    def __call__(self, robot: RobotDescription, _task: Task, period: float) -> "PolicyWalker":
        """Load the policy; NaoGaitError if it does not fit the robot or the period [s]."""
        policy, network = load_policy(self.path, robot)
        kind = TruePolicyWalker if self.true_velocity else PolicyWalker
        return kind(robot, policy, network, period)


class PolicyWalker:
    """Answers every sensor frame with the targets of a learned walk.

    Args:
        robot: The robot.
        policy: What the network sees, and what its actions mean.
        network: The ONNX file.
        period: Time between two frames [s].

    Attributes:
        status: After the last tick; a learned walk knows little.

    Raises:
        NaoGaitError: A network that cannot be read or does not fit, no onnxruntime, or a period of
            the policy that is not a multiple of that of the frames.
    """

    def __init__(
        self, robot: RobotDescription, policy: Policy, network: Path, period: float
    ) -> None:
        self._robot, self._policy, self._dt = robot, policy, period
        self._every = round(policy.period / period)
        if self._every < 1 or abs(self._every * period - policy.period) > 1e-6:
            raise NaoGaitError(
                "policy: period", policy.period, f"a multiple of the control period, {period:g} s"
            )
        count = len(robot.joint_names)
        names = policy.joints or robot.joint_names
        self._driven = _indices(robot, names)
        self._pose = np.zeros(count)
        for name, angle in policy.pose.items():
            self._pose[robot.index(name)] = angle
        self._terms = [
            (each, _indices(robot, each.joints or names), _indices(robot, each.blank))
            for each in policy.observations
        ]
        self._body = BodyModel(robot)
        self._orientation = TorsoOrientation(GRAVITY_TIME, 1.0)
        self._last = np.zeros(count)
        self._joint_velocity = np.zeros(count)
        self._velocity = np.zeros(3)
        self._soles: tuple[FloatArray, FloatArray] | None = None
        self._support, self._steps = LEFT, 0
        self._phases = np.array(policy.phases)
        self._command = np.zeros(3)
        self._action = np.zeros(len(self._driven))
        self._target = self._pose.copy()
        self._ticks = 0
        self.status = peer_status(0, GaitState.STAND, "double", 0)
        observed = self._observed(self._pose, np.zeros(3))
        self._network = load_network(network, len(observed), len(self._driven))

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        """The targets for this tick: new ones every period of the policy, else the last."""
        position = np.array(frame.joint_position, dtype=float)
        gyro = np.array(frame.angular_velocity, dtype=float)
        self._feel(frame, position, gyro)
        if self._ticks % self._every == 0:
            self._act(position, gyro, np.array((command.x, command.y, command.yaw)))
        self._ticks += 1
        self.status = peer_status(
            frame.stamp, GaitState.WALK, "left" if self._support == LEFT else "right", self._steps
        )
        return JointTargets(frame.stamp, self._target.copy())

    def _feel(self, frame: SensorFrame, position: FloatArray, gyro: FloatArray) -> None:
        """Update the vertical, the support, and the velocities of the joints and of the torso."""
        force = as_point(frame.linear_acceleration)
        if self._soles is None:
            # It may move at once: its accelerations are not gravity.
            self._orientation.reset(force, GRAVITY_TIME)
            self._last = position
        self._orientation.update(as_point(gyro), force, None, self._dt)
        self._joint_velocity = (position - self._last) / self._dt
        self._last = position
        self._body.set_joints(position)  # the soles are those of this call
        poses = [self._body.sole_in_torso(side) for side in (LEFT, RIGHT)]
        up = self._orientation.up_in_torso
        left_higher = dot(up, poses[0].position) - dot(up, poses[1].position)
        if self._support * left_higher > LOWER * self._robot.size:
            self._support, self._steps = -self._support, self._steps + 1
        soles = np.array(poses[0].position), np.array(poses[1].position)
        if self._soles is not None:
            side = 0 if self._support == LEFT else 1
            over_sole = (self._soles[side] - soles[side]) / self._dt - np.cross(gyro, soles[side])
            share = self._dt / (VELOCITY_TIME + self._dt)
            self._take_velocity(self._velocity + share * (over_sole - self._velocity))
        self._soles = soles

    def _take_velocity(self, over_sole: FloatArray) -> None:
        """(3,) [m/s] of the torso in its axes."""
        self._velocity = over_sole

    def _act(self, position: FloatArray, gyro: FloatArray, wanted: FloatArray) -> None:
        """Let the network choose new targets."""
        policy = self._policy
        most = policy.command_rate * policy.period
        self._command = self._command + np.clip(wanted - self._command, -most, most)
        action = self._network(self._observed(position, gyro))
        if not np.isfinite(action).all():
            raise NaoGaitError("policy: action", action[~np.isfinite(action)][0], "finite numbers")
        self._action = np.clip(action, -policy.clip, policy.clip)
        target = self._pose.copy()
        target[self._driven] += policy.scale * self._action
        self._target = np.clip(target, self._robot.lower, self._robot.upper)
        self._phases = self._phases + math.tau * policy.frequency * policy.period

    def _observed(self, position: FloatArray, gyro: FloatArray) -> FloatArray:
        """All observations in their order."""
        of: dict[str, Any] = {
            VELOCITY: self._velocity,
            "gyro": gyro,
            "gravity": -np.array(self._orientation.up_in_torso),
            "command": self._command,
            "phase": self._seen_phases(),
            "action": self._action,
        }
        found = []
        for each, joints, blank in self._terms:
            if each.of in of:
                found.append(each.scale * of[each.of])
                continue
            whole = position - self._pose if each.of == "joints" else self._joint_velocity.copy()
            whole[blank] = 0.0
            found.append(each.scale * whole[joints])
        return np.concatenate(found)

    def _seen_phases(self) -> FloatArray:
        """Cosines, then sines."""
        phases = self._phases
        if float(np.linalg.norm(self._command)) < self._policy.rest:
            if not self._policy.rest_phases:
                return np.zeros(2 * len(phases))
            phases = np.array(self._policy.rest_phases)
        return np.concatenate((np.cos(phases), np.sin(phases)))


class TruePolicyWalker(PolicyWalker):
    """Sees the true velocity of the torso."""

    def see(self, truth: GroundTruth) -> None:
        """Take it from the last control period."""
        self._velocity = np.array(truth.torso_linear_velocity_in_torso)

    def _take_velocity(self, over_sole: FloatArray) -> None:
        """It has a better one."""


def _indices(robot: RobotDescription, names: tuple[str, ...]) -> list[int]:
    return [robot.index(name) for name in names]


def load_network(path: Path, observations: int, actions: int) -> Network:
    """The function of an ONNX file from observations (n,) to actions (m,).

    Raises:
        NaoGaitError: No onnxruntime, no network, or one of other sizes; from the function: an error
            of the network.
    """
    try:
        import onnxruntime
    except ImportError:
        raise NaoGaitError("policy", "onnxruntime is not installed", HOW_TO_GET_IT) from None
    where = f"policy network {path}"
    if not path.is_file():
        raise NaoGaitError(where, "no such file", "an ONNX file beside that of the policy")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    try:
        session = onnxruntime.InferenceSession(
            str(path), options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # its errors have no common public class
        raise NaoGaitError(where, _first_line(error), "an ONNX network") from None
    entries = session.get_inputs()
    if len(entries) != 1:
        raise NaoGaitError(where, f"{len(entries)} inputs", "one, the observations")
    name, taken = entries[0].name, entries[0].shape[-1:]
    if isinstance(taken, list) and taken and isinstance(taken[0], int) and taken[0] != observations:
        raise NaoGaitError(
            where, f"takes {taken[0]} numbers", f"{observations}, as many as its observations"
        )

    def run(observed: FloatArray) -> FloatArray:
        try:
            answer = session.run(None, {name: observed.astype(np.float32)[None, :]})[0]
        except Exception as error:
            raise NaoGaitError(where, _first_line(error), "one row of float32") from None
        return np.asarray(answer, dtype=float).ravel()

    given = len(run(np.zeros(observations)))
    if given != actions:
        raise NaoGaitError(
            where, f"gives {given} numbers", f"{actions}, as many as joints of the actions"
        )
    return run


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)[:200]
