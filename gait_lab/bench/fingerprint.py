"""`nao_gait fingerprint`: hashes of reference rollouts; same hashes, same walk to the bit.

Every preset walks a short course of commands with a push, the default one also sideways and fast on
a stiff floor, where it sways; every motion of a robot that begins from a stand, the front or the
back runs once, in each engine. In MuJoCo, every fault of the gait disturbs one walk, and four
players play without a referee, and with one. Hashed are the motion itself (joints, torso, motor
torques) and the gait's own estimates (odometry, CoM), so that a refactoring can show that it
changed nothing, and a figure can say which walk it was measured on.
"""

import hashlib
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.faults.campaign import FAULTS
from gait_lab.faults.harness import Harness
from gait_lab.soccer.match import Match, MatchSpec
from gait_lab.soccer.pitch import Pitch
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.presets import DEFAULT
from robot_core.errors import NaoGaitError
from robot_core.motion.keyframes import Motion, Posture
from robot_core.motion.library import shipped_library
from robot_core.schema import read_text
from robot_core.types import STANDSTILL, GaitStatus, VelocityCommand
from sim_bridge.ball import Ball
from sim_bridge.robot import GroundTruth
from sim_bridge.scene import load_scene
from sim_bridge.trials.metrics import yaw_of
from sim_bridge.trials.motions import spot_in_world
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    Policy,
    Push,
    Tick,
    TimedCommands,
    TrialSpec,
    loaded_robot,
    make_gait,
    make_world,
    run,
)
from sim_bridge.world import World

State = tuple[GroundTruth, GaitStatus | None]
Moment = tuple[Sequence[State], Sequence[float]]
"""All robots after a control period, and what else is hashed."""

ENGINES = ("mujoco", "pybullet")
LARGEST = 4 * 1024 * 1024
"""[bytes] of an earlier output."""
SEED = 3
"""Robot and noise of all reference rollouts."""

HEXAGONS = ("terrain.kind", "hexagons")
# preset -> robot, plant, options of the plant, speed share of the course
PRESETS = {
    "default": ("nao_h21_v33", "reference", (), 1.0),
    "paper": ("nao_h21_v33", "reference", (), 0.4),
    "zmp": ("nao_h21_v33", "reference", (), 0.5),
    "preview": ("nao_h21_v33", "reference", (), 0.5),
    "ideal": ("nao_h21_v33", "ideal", (), 0.6),
    "nao_v6": ("nao_v6", "reference", (), 1.0),
    "bruno": ("bruno", "reference", (), 0.6),
    "booster_t1": ("booster_t1", "reference", (), 1.0),
    "booster_k1": ("booster_k1", "reference", (), 1.0),
    "op3": ("op3", "reference", (), 0.6),
    "rough_fast": ("bruno", "reference", (HEXAGONS, ("sole.kind", "sponge")), 0.4),
    "rough_slow": ("bruno", "reference", (HEXAGONS, ("sole.kind", "spring")), 0.2),
}
COURSE = (
    (1.0, STANDSTILL),
    (2.0, VelocityCommand(0.40, 0.0, 0.0)),
    (4.0, VelocityCommand(0.40, 0.0, 0.0)),
    (4.5, VelocityCommand(0.10, 0.10, 0.6)),
    (6.0, VelocityCommand(-0.20, -0.05, -0.6)),
    (7.0, STANDSTILL),
)
"""Times [s] and commands, linear between them."""
SIDE_COURSE = (
    (1.0, STANDSTILL),
    (2.0, VelocityCommand(0.0, 0.22, 0.0)),
    (4.0, VelocityCommand(0.0, 0.22, 0.0)),
    (5.0, VelocityCommand(0.05, -0.2, 0.2)),
    (7.0, VelocityCommand(0.0, -0.22, 0.0)),
    (7.5, STANDSTILL),
)
COURSE_TIME = 8.5
"""[s]"""
SWAY_COURSE = ((1.0, STANDSTILL), (4.0, VelocityCommand(0.47, 0.0, 0.0)))
STIFF_FLOOR = (("contact.stiffness", 4.0e4), ("variation.stiffness_scale", None))
SWAYING = 0
"""Robot that sways there: its strides become shorter from the first second at speed on."""
PUSH = Push(time=3.0, impulse=0.6, direction=math.radians(100.0))
STARTS = {
    Posture.STANDING: "stand",
    Posture.LYING_FRONT: "lying_front",
    Posture.LYING_BACK: "lying_back",
}
"""Start states of the simulation by the posture that a motion begins from."""
PLACE_TOLERANCE, TURN_TOLERANCE = 0.02, math.radians(2.0)
"""[m] and [rad] between two ends of the same walk on other processors."""
PLAY_SCENE, PLAY_TIME = "pitch_small", 6.0
"""Scene of the players, and for how long [s] they play; they reach the ball in it."""
MATCH_TIME = 32.0
"""[s] of the match with a referee; the ball is in play for the last third."""
MOTION_AT, MOTION_REST = 1.5, 1.0
"""[s] when a motion is requested, and for how long the robot is watched after it."""


@dataclass(frozen=True, slots=True)
class Case:
    """One reference rollout.

    Attributes:
        engine: `mujoco` or `pybullet`.
        name: `walk/PRESET`, `side/PRESET`, `sway/PRESET`, `motion/ROBOT/MOTION`, `fault/FAULT`,
            `soccer/play` or `soccer/match`.
    """

    engine: str
    robot: str
    name: str

    @property
    def key(self) -> str:
        """ENGINE/ and the name."""
        return f"{self.engine}/{self.name}"


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """Hash and end pose of a reference rollout.

    Attributes:
        digest: The first 16 hexadecimal digits of a SHA-256.
        pose: Where the torso ended: x, y [m] in the world, yaw [rad]; of several robots the sums.
    """

    key: str
    digest: str
    pose: tuple[float, float, float]

    def as_list(self) -> list[str | float]:
        """Digest and end pose, for a JSON file."""
        return [self.digest, *(round(value, 4) for value in self.pose)]

    def is_same_walk(self, stored: Sequence[Any]) -> bool:
        """Whether an earlier `as_list` is of the same walk.

        The digest is of exact bits, which differ between processors with other vector units: there
        the same walk ends within `PLACE_TOLERANCE` and `TURN_TOLERANCE` of the earlier pose.
        """
        digest, x, y, yaw = stored
        off = math.hypot(self.pose[0] - x, self.pose[1] - y)
        turned = abs(math.remainder(self.pose[2] - yaw, math.tau))
        return digest == self.digest or (off <= PLACE_TOLERANCE and turned <= TURN_TOLERANCE)


def cases(engines: Iterable[str] = ENGINES) -> Iterator[Case]:
    """All reference rollouts in these engines."""
    for engine in engines:
        for preset, (robot, *_) in PRESETS.items():
            if engine == "mujoco" and preset == "ideal":
                continue  # motors without any lag are PyBullet's alone
            if engine == "pybullet" and loaded_robot(robot).soft_joint:
                continue  # and soft ones MuJoCo's
            yield Case(engine, robot, f"walk/{preset}")
        yield Case(engine, "nao_h21_v33", "side/default")
        yield Case(engine, "nao_h21_v33", "sway/default")
        for robot in ("nao_h21_v33", "bruno"):
            for name, motion in shipped_library(loaded_robot(robot)).motions.items():
                if any(map(motion.begins_from, STARTS)):
                    yield Case(engine, robot, f"motion/{robot}/{name}")
        if engine == "mujoco":
            for fault in FAULTS:
                yield Case(engine, "nao_h21_v33", f"fault/{fault}")
            yield Case(engine, "nao_h21_v33", "soccer/play")
            yield Case(engine, "nao_h21_v33", "soccer/match")


def fingerprint(case: Case) -> Fingerprint:
    """Run one reference rollout."""
    kind, _, name = case.name.partition("/")
    run: Callable[[Case, str], Iterator[Moment]]
    run = {
        "walk": _walk, "side": _sideways, "sway": _swaying, "motion": _motion, "fault": _fault,
        "soccer": _soccer,
    }[kind]  # fmt: skip
    whole = hashlib.sha256()
    states: Sequence[State] = ()
    for states, others in run(case, name.rpartition("/")[2]):
        for truth, status in states:
            whole.update(_bytes(truth, status))
        whole.update(np.array(others, dtype=float).tobytes())
    ends = [(*truth.torso_position[:2], yaw_of(truth.torso_quaternion)) for truth, _ in states]
    x, y, yaw = np.sum(ends, axis=0).tolist()
    return Fingerprint(case.key, whole.hexdigest()[:16], (x, y, yaw))


def fingerprints(chosen: Iterable[Case], jobs: int | None = None) -> dict[str, Fingerprint]:
    """Run reference rollouts over all cores; by key."""
    found = parallel_map(fingerprint, chosen, jobs=jobs, label="reference rollouts")
    return {each.key: each for each in found}


def fingerprints_of(keys: Iterable[str], jobs: int | None = None) -> dict[str, Fingerprint]:
    """Only the reference rollouts of these keys; unknown keys are left out."""
    wanted = set(keys)
    return fingerprints([case for case in cases() if case.key in wanted], jobs)


def command(
    say: Callable[[str], None], *, engine: list[str] | None, compare: Path | None, jobs: int | None
) -> int:
    """Print the hashes, or compare them with an earlier output; the exit status."""
    engines = tuple(engine or ENGINES)
    before = None if compare is None else _read(compare, engines)
    found = fingerprints(cases(engines), jobs)
    if before is None:
        json.dump(
            {key: each.as_list() for key, each in sorted(found.items())}, sys.stdout, indent=0
        )
        say("")
        return EXIT_OK
    changed = _changed(before, found, engines)
    for key in changed:
        similar = key in found and key in before and found[key].is_same_walk(before[key])
        cause = "another processor, or a small change of the walk"
        note = f" (but ends within 2 cm and 2 deg: {cause})" if similar else ""
        say(f"changed: {key}{note}")
    say(f"{len(found)} reference rollouts, {len(changed)} changed")
    return EXIT_FAILED if changed else EXIT_OK


def _read(file: Path, engines: Sequence[str]) -> dict[str, list[Any]]:
    """Key -> digest and end pose of an earlier output; raises NaoGaitError."""
    try:
        content = json.loads(read_text(file, "fingerprints", LARGEST))
        before = {
            key: [str(digest), float(x), float(y), float(yaw)]
            for key, (digest, x, y, yaw) in content.items()
        }
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        allowed = f"output of nao_gait fingerprint ({error})"
        raise NaoGaitError("compare", str(file), allowed) from error
    if not any(key.split("/")[0] in engines for key in before):
        allowed = f"output of nao_gait fingerprint with walks in {' or '.join(engines)}"
        raise NaoGaitError("compare", str(file), allowed)
    return before


def _changed(
    before: Mapping[str, Sequence[Any]], found: Mapping[str, Fingerprint], engines: Sequence[str]
) -> list[str]:
    """Keys in these engines that are gone or have another digest; new ones were not there."""
    wanted = sorted(key for key in before if key.split("/")[0] in engines)
    return [key for key in wanted if key not in found or before[key][0] != found[key].digest]


def _bytes(truth: GroundTruth, status: GaitStatus | None) -> bytes:
    arrays = [
        truth.torso_position, truth.torso_quaternion, truth.joint_position, truth.joint_torque,
    ]  # fmt: skip
    if status is not None:
        said = (*status.base_footprint_in_odom, *status.com_estimated_in_q)
        arrays.append(np.array(said, dtype=float))
    return b"".join(np.asarray(array, dtype=float).tobytes() for array in arrays)


Knots = Sequence[tuple[float, VelocityCommand]]


def _command_at(course: Knots, time: float, share: float) -> VelocityCommand:
    times = [knot for knot, _ in course]
    axes = zip(*(command for _, command in course), strict=True)
    x, y, yaw = (share * float(np.interp(time, times, axis)) for axis in axes)
    return VelocityCommand(x, y, yaw)


def _spec(case: Case, preset: str, **options: Any) -> TrialSpec:
    return TrialSpec(
        robot_seed=SEED,
        noise_seed=SEED,
        parameters=load_preset(preset),
        urdf=case.robot,
        engine=case.engine,
        **options,
    )


def _sideways(case: Case, preset: str) -> Iterator[Moment]:
    return _walk(case, preset, SIDE_COURSE)


def _swaying(case: Case, preset: str) -> Iterator[Moment]:
    spec = replace(_spec(case, preset, plant_options=STIFF_FLOOR), robot_seed=SWAYING)
    return _follow(spec, TimedCommands(lambda time: _command_at(SWAY_COURSE, time, 1.0)))


def _walk(case: Case, preset: str, course: Knots = COURSE) -> Iterator[Moment]:
    _, plant, options, share = PRESETS[preset]
    spec = _spec(case, preset, plant=plant, plant_options=options)
    return _follow(spec, TimedCommands(lambda time: _command_at(course, time, share), (PUSH,)))


def _follow(spec: TrialSpec, policy: Policy) -> Iterator[Moment]:
    with make_world(spec) as world:
        ticks = run(world, make_gait(spec), policy)
        for tick in islice(ticks, round(COURSE_TIME / CONTROL_PERIOD)):
            yield [(tick.truth, tick.status)], ()


class _OneMotion(Policy):
    """Requests a motion of a standing robot; a kick gets a ball."""

    def __init__(self, world: World, gait: Gait, motion: Motion) -> None:
        self._world, self._gait, self._motion = world, gait, motion

    def command(self, time: float, tick: Tick | None) -> VelocityCommand:
        if round(time / CONTROL_PERIOD) == round(MOTION_AT / CONTROL_PERIOD):
            if (kick := self._motion.kick) is not None:
                x, y = spot_in_world(self._world.robot.truth(), kick.x, kick.y)
                self._world.put_ball(float(x), float(y))
            self._gait.request_motion(self._motion)
        return STANDSTILL


def _motion(case: Case, name: str) -> Iterator[Moment]:
    robot = loaded_robot(case.robot)
    motion = shipped_library(robot).find(name)
    start = next(state for posture, state in STARTS.items() if motion.begins_from(posture))
    spec = _spec(case, robot.preset or DEFAULT)
    with make_world(spec, start_state=start, ball=Ball(-5.0, 5.0)) as world:
        gait = make_gait(spec)
        ticks = run(world, gait, _OneMotion(world, gait, motion), past_falls=True)
        count = round((MOTION_AT + motion.time + MOTION_REST) / CONTROL_PERIOD)
        for before, tick in pairwise(islice(ticks, count + 1)):
            # The state after a control period, with the status of the frame answered before it.
            yield [(tick.truth, before.status)], ()


def _fault(case: Case, name: str) -> Iterator[Moment]:
    spec = _spec(case, "default")
    with make_world(spec) as world:
        fault = FAULTS[name](np.random.default_rng(SEED))
        harness = Harness(world, spec.parameters, fault, VelocityCommand(0.2, 0.0, 0.0))
        for _ in range(round(fault.end / CONTROL_PERIOD)):
            harness.step()
            status = harness.gaits[0].controller.last_status if harness.gaits else None
            yield [(harness.truth, status)], ()


def _soccer(case: Case, name: str) -> Iterator[Moment]:
    if name == "match":
        spec = MatchSpec(scene=PLAY_SCENE, seed=SEED, engine=case.engine, frames=False)
        with Match(spec) as match:
            for ticks in islice(match.run(), round(MATCH_TIME / CONTROL_PERIOD)):
                score = tuple(match.referee.score.values())
                yield (
                    [(tick.truth, tick.status) for tick in ticks],
                    (*match.pitch.ball_position, *score),
                )
        return
    with Pitch(load_scene(PLAY_SCENE), SEED, case.engine, "reference") as pitch:
        periods = round(PLAY_TIME / CONTROL_PERIOD)
        for ticks in islice(pitch.run(), periods):
            yield [(tick.truth, tick.status) for tick in ticks], pitch.ball_position
