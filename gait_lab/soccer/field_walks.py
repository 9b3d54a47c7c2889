"""Walks of random commands on a field, recorded once: what a robot measured, and the truth.

The world model does not act on the body. So one walk in the physics serves many runs of it: with
other percepts, other delays, other faults.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import attrs
import numpy as np
from numpy.typing import NDArray

from gait_lab.soccer.pitch import PitchSpec, with_robots
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.runtime.commands import LONGEST_BIAS_WAIT, BiasWait
from robot_core.errors import NaoGaitError
from robot_core.geometry import relative
from robot_core.types import STANDSTILL, FloatArray, Pose2, VelocityCommand
from sim_bridge.scene import Scene, load_scene
from sim_bridge.trials.trial import (
    Action,
    Policy,
    Tick,
    WalkerResponder,
    make_gaits,
    make_scene_world,
    run_responder,
)

EVERY = 2
"""Control periods between two samples."""
SPEEDS = VelocityCommand(0.25, 0.12, math.radians(50.0))
"""[m/s, m/s, rad/s] Largest random commands."""
LASTS = (1.0, 4.0)
"""[s] Shortest and longest time that one command lasts."""
STAND_SHARE = 0.1
"""Share of the commands that are standstill."""
MARGIN = 0.4
"""[m] Distance from the outer lines from which on the robot turns to the centre."""
START_MARGIN = 0.7
"""[m] Least distance of the start from the outer lines."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkSpec(PitchSpec):
    """A walk; only the field of its scene is used.

    Attributes:
        seconds: Length [s] after the robot may walk.
    """

    urdf: str = "nao_h21_v33"
    seconds: float = 60.0


class WalkSamples(NamedTuple):
    """What one robot measured on a walk, and the truth; n samples at equal distances in time.

    Attributes:
        stamp: (n,) [ns]
        odometry: (n, 3) base_footprint in odom: x, y [m], yaw [rad].
        torso: (n, 6) the torso in base_footprint by the gait: x, y, z [m], roll, pitch, yaw [rad].
        truth: (n, 3) base_footprint in the frame of the field.
    """

    stamp: NDArray[np.int64]
    odometry: FloatArray
    torso: FloatArray
    truth: FloatArray

    def until(self, seconds: float) -> "WalkSamples":
        """Its first seconds."""
        end = int(seconds * 1e9 / float(self.stamp[1] - self.stamp[0]))
        columns: dict[str, Any] = {name: getattr(self, name)[:end] for name in self._fields}
        return WalkSamples(**columns)


class RandomWalk(Policy):
    """Random velocities that last for random times; near the border the robot turns inwards.

    Its gyro's bias has to be known before the first command, as over ROS; `seconds` [s] count from
    then on.
    """

    def __init__(self, half: tuple[float, float], seed: int, gait: Gait, seconds: float) -> None:
        self._inner = tuple(each - MARGIN for each in half)
        self._random = np.random.default_rng((seed, 1))
        self._gait = gait
        self._wait = BiasWait(LONGEST_BIAS_WAIT)
        self._seconds = seconds
        self._end: float | None = None
        self._until = 0.0
        self._now = STANDSTILL

    def command(self, time: float, tick: Tick | None) -> Action:
        """The command of this time; None at the end."""
        if tick is None:
            return STANDSTILL
        known = None if tick.status is None else self._gait.heading_drift_sigma
        if self._wait.update(round(time * 1e9), self._gait.state, known):
            return STANDSTILL
        if self._end is None:
            self._end = time + self._seconds
        if time >= self._end:
            return None
        x, y, yaw = tick.truth.base_footprint
        ahead = x + 0.2 * math.cos(yaw), y + 0.2 * math.sin(yaw)
        if any(abs(a) > limit for a, limit in zip(ahead, self._inner, strict=True)):
            return self._inwards((x, y, yaw))
        if time >= self._until:
            self._until = time + self._random.uniform(*LASTS)
            self._now = self._drawn()
        return self._now

    def _drawn(self) -> VelocityCommand:
        if self._random.random() < STAND_SHARE:
            return STANDSTILL
        x, y, yaw = (limit * self._random.uniform(-1.0, 1.0) for limit in SPEEDS)
        # Walking sideways and backwards is slower, as a player would do it.
        return VelocityCommand(x if x > 0.0 else 0.5 * x, y, yaw)

    def _inwards(self, pose: Pose2) -> VelocityCommand:
        self._until = 0.0
        bearing = relative((0.0, 0.0, 0.0), pose)
        angle = math.atan2(bearing[1], bearing[0])
        turn = math.copysign(min(abs(angle), SPEEDS.yaw), angle)
        return VelocityCommand(0.15 * max(0.0, math.cos(angle)), 0.0, turn)


def record(spec: WalkSpec) -> WalkSamples:
    """Walk in the physics; the same specification gives the same walk.

    Raises:
        NaoGaitError: The scene has no field.
    """
    scene = attrs.evolve(scene_of(spec), ball=None)
    rows = []
    truths: dict[int, Pose2] = {}
    with make_scene_world(
        scene, plant=spec.plant, engine=spec.engine, noise_seed=spec.seed
    ) as world:
        (gait,) = make_gaits(world)
        policy = RandomWalk(half_of(scene), spec.seed, gait, spec.seconds)
        controller = WalkerResponder(world, world.robot, gait, policy)
        ticks = run_responder(world, controller, lambda *_: None, past_falls=True)
        for count, tick in enumerate(ticks):
            truths[tick.truth.stamp] = tick.truth.base_footprint
            status = tick.status
            if status is None or count % EVERY or status.stamp not in truths:
                continue
            truth = truths[status.stamp]
            for old in [stamp for stamp in truths if stamp < status.stamp]:
                del truths[old]
            rows.append((status.stamp, status.base_footprint_in_odom, gait.torso_pose, truth))
    return WalkSamples(*(np.array(column) for column in zip(*rows, strict=True)))


def scene_of(spec: WalkSpec) -> Scene:
    """The scene with this robot alone, at a random start; NaoGaitError if it has no field."""
    scene = load_scene(spec.scene)
    if scene.field is None:
        raise NaoGaitError("scene", spec.scene, "a scene with a field")
    half = half_of(scene)
    random = np.random.default_rng((spec.seed, 0))
    start = [random.uniform(-1.0, 1.0) * (each - START_MARGIN) for each in half]
    pose = (start[0], start[1], random.uniform(-math.pi, math.pi))
    return with_robots(scene, [pose], urdf=spec.urdf, seed=spec.seed)


def half_of(scene: Scene) -> tuple[float, float]:
    """Half length and half width [m] of the field."""
    field = scene.field
    return (0.0, 0.0) if field is None else (field.length / 2.0, field.width / 2.0)
