"""Protocols: how a set of parameters is tried on one robot, and what is measured.

Add a protocol by its options, a function that returns `Measures`, and an entry in `PROTOCOLS`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import islice
from statistics import fmean
from typing import Any

import attrs

from gait_lab.tune import growing_stride
from robot_core.errors import NaoGaitError
from robot_core.schema import Settings, number
from robot_core.types import VelocityCommand
from sim_bridge.trials.metrics import FLIGHT_LIMIT, SLIP_LIMIT, Metrics, measure
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import SPOT_TURN, Task
from sim_bridge.trials.tasks import walk as walk_task
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    Push,
    TimedCommands,
    TrialSpec,
    make_gait,
    make_world,
    run,
)

CONTACT_LIMIT = 0.01
"""Share of ticks with contact of the legs that costs as much as twice the flight limit."""
EXCESS_MAX = 3.0
"""Upper limit of `Measures.excess`."""
FALL_ERROR = 0.05
"""CoM error [m] that is assumed for a robot that fell."""
DRIFT_MAX = 0.1
"""Drift on the spot [m/s] that is assumed for a robot that fell."""


@dataclass(frozen=True, slots=True)
class Measures:
    """Result of a protocol on one robot.

    Attributes:
        robot: Seed of the robot.
        values: Measured values by name, SI units.
        fell: Whether the robot fell.
        excess: Sum of the shares by which flight, slip and leg contact exceed their limits; 0 for
            proper walking.
    """

    robot: int
    values: Mapping[str, float]
    fell: bool
    excess: float = 0.0


def excess_of(metrics: Metrics) -> float:
    """Return the sum of the shares by which flight, slip and contact exceed their limits."""
    contact = metrics.contact_ticks * 0.01 / metrics.duration if metrics.duration > 0.0 else 0.0
    over = (
        metrics.flight_share / FLIGHT_LIMIT - 1.0,
        metrics.slip_speed / SLIP_LIMIT - 1.0,
        contact / CONTACT_LIMIT,
    )
    return min(EXCESS_MAX, sum(max(0.0, each) for each in over))


# -- com_error: the first paper's criterion --------------------------------------------------------


@attrs.frozen
class ComErrorOptions(Settings):
    """Commanded speeds (0 = not walked) and the time of the measurement."""

    forward: float = number(0.31, 0.0, 0.6, "m/s")
    back: float = number(0.0, 0.0, 0.6, "m/s")
    side: float = number(0.0, 0.0, 0.4, "m/s")
    turn: float = number(0.0, 0.0, 150.0, "deg/s")
    window: float = number(5.0, 1.0, 60.0, "s")


def com_error(spec: TrialSpec, options: ComErrorOptions) -> Measures:
    """Measure the CoM error along y, on the spot and in the directions with a speed.

    The paper compares the expected CoM with the measured one. This criterion alone can be cheated:
    an observer that trusts its sensors makes the error small and the walk slow, or even backward.
    Therefore the same walks also give the error against the truth and how well the speeds are
    reached; a robot that falls or does not move scores badly.
    """
    walks = [(walk_task("spot", yaw=SPOT_TURN, window=options.window), 0.0)]
    walks += [(task, asked) for task, asked in _directions(options) if asked > 0.0]
    metrics = [_walk_task(spec, task) for task, _ in walks]
    reached = [
        1.0 - abs(_speed(m, task) - asked) / asked
        for m, (task, asked) in zip(metrics, walks, strict=True) if asked > 0.0
    ]  # fmt: skip
    spot = metrics[0]
    values = {
        "error_measured": fmean(
            _if_upright(m, m.com_error_y_measured, FALL_ERROR) for m in metrics
        ),
        "error_true": fmean(_if_upright(m, m.com_error_y, FALL_ERROR) for m in metrics),
        "reached": fmean(reached) if reached else 1.0,
        "drift": _if_upright(spot, math.hypot(spot.speed_x, spot.speed_y), DRIFT_MAX),
        "upright": 1.0 - fmean(m.fell for m in metrics),
    }
    excess = fmean(excess_of(m) for m in metrics)
    return Measures(spec.robot_seed, values, any(m.fell for m in metrics), excess)


def _directions(options: "ComErrorOptions | OmniOptions") -> list[tuple[Task, float]]:
    """The walks forward, back, to the side and in a turn, and their speeds [m/s, rad/s]."""
    window, turn = options.window, math.radians(options.turn)
    return [
        (walk_task("forward", x=options.forward, axis="x", window=window), options.forward),
        (walk_task("back", x=-options.back, axis="x", window=window), options.back),
        (walk_task("side", y=options.side, axis="y", window=window), options.side),
        (walk_task("turn", yaw=turn, axis="yaw", window=window), turn),
    ]


def _speed(metrics: Metrics, task: Task) -> float:
    """Speed in the commanded direction [m/s or rad/s]; 0 after a fall."""
    attribute = {"x": "speed_x", "y": "speed_y", "yaw": "turn_rate"}[task.axis or "x"]
    speed = math.copysign(1.0, task.asked) * getattr(metrics, attribute)
    return _if_upright(metrics, speed, 0.0)


def _walk_task(spec: TrialSpec, task: Task) -> Metrics:
    return rollout(RolloutSpec(task, **spec.fields)).metrics


def _if_upright(metrics: Metrics, value: float, otherwise: float) -> float:
    return value if math.isfinite(value) and not metrics.fell else otherwise


# -- growing_stride: the second paper's experiment -------------------------------------------------

TOP_STEPS = 12
"""Number of last steps over which the speed is measured without a hold."""
_TAIL = 1.0
"""Time [s] past the end of the trace, so that the window holds its last tick."""


def growing_stride_walk(spec: TrialSpec, options: growing_stride.GrowingStrideOptions) -> Measures:
    """Measure the distance until the last step or the fall, and the final speed.

    The speed is the mean along the torso's heading over the hold, or over the last steps without a
    hold; 0 for a robot that falls.
    """
    trace, policy, fell = growing_stride.walk_growing_stride(spec, options)
    end = float(trace.time[-1]) + _TAIL
    metrics = measure(trace, growing_stride.STAND_TIME, end)
    top_from = policy.done_at if options.hold > 0.0 else None
    if top_from is None:
        times = policy.step_times
        top_from = times[-TOP_STEPS] if len(times) >= TOP_STEPS else growing_stride.STAND_TIME
    top = measure(trace, top_from, end)
    values = {
        "distance": max(0.0, growing_stride.distance(trace, policy.done_at)),
        "speed": 0.0 if fell else _finite(top.speed_x),
        "steps": float(min(len(policy.step_times), options.steps)),
        "drift": _finite(metrics.turn_rate),
        "flight": _finite(top.flight_share),
        "slip": _finite(top.slip_speed),
    }
    return Measures(spec.robot_seed, values, fell, max(excess_of(metrics), excess_of(top)))


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


# -- omni: four directions, CoM error and pushes ---------------------------------------------------

SPOT_TIME = 1.0
"""Time from which the robot steps on the spot [s]."""
PUSH_FIRST = 3.0
"""Time of the first push [s]."""
PUSH_EVERY = 2.63
"""Time between two pushes [s]; not a multiple of a step, so that each meets another phase."""
PUSH_DIRECTIONS = (math.radians(90.0), 0.0, math.radians(-90.0), math.radians(180.0))
"""Directions of the pushes [rad], counter-clockwise from the heading of the robot."""


@attrs.frozen
class OmniOptions(Settings):
    """Commanded speeds, the time of the measurement, and the impulse of a push."""

    forward: float = number(0.25, 0.01, 0.6, "m/s")
    back: float = number(0.20, 0.01, 0.6, "m/s")
    side: float = number(0.09, 0.01, 0.4, "m/s")
    turn: float = number(45.0, 1.0, 150.0, "deg/s")
    window: float = number(5.0, 1.0, 60.0, "s")
    impulse: float = number(1.0, 0.0, 5.0, "N s")


def omni(spec: TrialSpec, options: OmniOptions) -> Measures:
    """Measure four walks and a series of pushes while stepping on the spot.

    Speeds are in the commanded direction. `reached` is the mean over the four of 1 minus the
    relative error of the speed. `upright` is the share of the walks without a fall, `pushes` the
    share of the pushes without a fall.
    """
    walks = _directions(options)
    metrics = [_walk_task(spec, task) for task, _ in walks]
    errors = [_if_upright(m, m.com_error_y, FALL_ERROR) for m in metrics]
    speeds = {task.name: _speed(m, task) for m, (task, _) in zip(metrics, walks, strict=True)}
    off = [abs(speeds[task.name] - asked) / asked for task, asked in walks]
    values = {
        **speeds,
        "reached": 1.0 - sum(off) / len(off),
        "error_true": sum(errors) / len(errors),
        "upright": 1.0 - sum(m.fell for m in metrics) / len(metrics),
        "pushes": _share_of_pushes_survived(spec, options.impulse),
    }
    excess = sum(excess_of(m) for m in metrics) / len(metrics)
    return Measures(spec.robot_seed, values, any(m.fell for m in metrics), excess)


def _step_on_the_spot(time: float) -> VelocityCommand:
    return VelocityCommand(0.0, 0.0, SPOT_TURN if time > SPOT_TIME else 0.0)


def _share_of_pushes_survived(spec: TrialSpec, impulse: float) -> float:
    """Push once in each direction with an impulse [N s], until the robot falls."""
    pushes = [
        Push(PUSH_FIRST + i * PUSH_EVERY, impulse, direction)
        for i, direction in enumerate(PUSH_DIRECTIONS)
    ]
    ticks = round((PUSH_FIRST + len(pushes) * PUSH_EVERY) / CONTROL_PERIOD)
    with make_world(spec) as world:
        policy = TimedCommands(_step_on_the_spot, pushes)
        for tick in islice(run(world, make_gait(spec), policy), ticks + 1):
            if tick.fallen:
                begun = sum(push.time <= world.time * 1e-9 for push in pushes)
                return max(0, begun - 1) / len(pushes)
    return 1.0


# -- the protocols by name -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Protocol:
    """How parameters are tried.

    Attributes:
        name: Name in a study.
        run: Tries the parameters of a spec on its robot, with options of the type `options`.
        options: Type of the options.
        measures: Units of the measures by name.
    """

    name: str
    run: Callable[[TrialSpec, Any], Measures]
    options: type[Settings]
    measures: Mapping[str, str]


PROTOCOLS: Mapping[str, Protocol] = {
    protocol.name: protocol
    for protocol in (
        Protocol(
            "growing_stride",
            growing_stride_walk,
            growing_stride.GrowingStrideOptions,
            {"distance": "m", "speed": "m/s", "steps": "", "drift": "rad/s", "flight": "",
             "slip": "m/s"},
        ),
        Protocol(
            "com_error",
            com_error,
            ComErrorOptions,
            {"error_measured": "m", "error_true": "m", "reached": "", "drift": "m/s",
             "upright": ""},
        ),
        Protocol(
            "omni",
            omni,
            OmniOptions,
            {"forward": "m/s", "back": "m/s", "side": "m/s", "turn": "rad/s", "reached": "",
             "error_true": "m", "upright": "", "pushes": ""},
        ),
    )
}  # fmt: skip


def find_protocol(name: Any) -> Protocol:
    """Return a protocol by its name; NaoGaitError for an unknown one."""
    protocol = PROTOCOLS.get(name) if isinstance(name, str) else None
    if protocol is None:
        raise NaoGaitError("study.protocol.name", name, PROTOCOLS)
    return protocol
