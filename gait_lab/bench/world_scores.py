"""Scores of the world model over many trials: of the own pose and of the ball; delays."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Measurement
from gait_lab.soccer.field_walks import WalkSamples, WalkSpec, walks
from gait_lab.soccer.rendered_trial import run_rendered
from gait_lab.soccer.world_trial import (
    Gap,
    WorldTrace,
    WorldTrialSpec,
    run_trial,
    spliced,
    turned_after,
)
from nao_soccer.world.state import HeadMode
from robot_core.types import FloatArray
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map

SETTLED = 2.0
"""[s] From the start on that do not count: the filters begin."""
GAP_TIME = 20.0
"""[s] After the start at which a robot is carried away or falls."""
CARRY, LIE = 2.0, 6.0
"""[s] For which it is carried; for which it lies and gets up."""
FALL_TURN = math.radians(60.0)
"""[rad] Largest turn by a fall that odometry does not notice."""
RIGHT = 0.3, math.radians(15.0)
"""[m, rad] A pose with smaller errors is right."""
FOUND_AFTER = 20.0
"""[s] After a fall within which the pose has to be right again."""
WRONG = 0.5
"""[m] Error with which a pose must not be valid."""
INSIDE_95 = 7.815
"""Squared deviations that 95 % of the errors of three variables do not exceed."""
NEAR = 2.0
"""[m] Balls that are nearer count."""
ROLLING, ROLLED_FOR = 0.05, 0.5
"""[m/s, s] A ball that rolls faster, for at least this long."""
DELAYS = (0.0, 0.1, 0.3)
"""[s] Delays of the images of the ablation."""
IGNORED = 0.3
"""[s] Delay of the images that the filters of its last row do not know."""
REPEAT_SEED = 1000
"""Between the seeds of two trials over one walk."""
Score = TypeVar("Score")


@dataclass(frozen=True)
class WorldOptions(BenchOptions):
    """What the suites of the world model run on."""

    robots: int = option(20, "number of robots", "N", minimum=1, maximum=1000)
    window: float = option(
        60.0, "time that each robot walks [s]", "T", flags=("--seconds",),
        minimum=4.0, maximum=3600.0,
    )  # fmt: skip
    scene: str = option("pitch_small", "field and goals: a shipped scene or a file", "NAME")
    ablation: bool = option(True, "the measured delay only", flags=("--no-ablation",))
    repeats: int = option(
        1, "trials over each walk, with other percepts each", "N", minimum=1, maximum=1000
    )
    vision: str = option(
        "model", "percepts by the measured model, or from rendered images", "KIND",
        choices=("model", "camera"),
    )  # fmt: skip
    walks: Path | None = option(
        None, "keep recorded walks in this folder, and use those that are there", "DIR", parse=Path
    )
    engine: str = "mujoco"


@dataclass(frozen=True, slots=True)
class Job:
    """One trial.

    Attributes:
        kind: `known`, `carried` or `fall`.
        spec: The trial.
        walks: Walks in the order in which they are walked.
    """

    kind: str
    spec: WorldTrialSpec
    walks: tuple[WalkSamples, ...]


def walks_of(options: WorldOptions) -> list[WalkSamples]:
    """A recorded walk of each robot, for percepts by the model; none for rendered images.

    Raises:
        NaoGaitError: The scene has no field.
    """
    if options.vision == "camera":
        return []
    return walks(specs_of(options), options.walks, jobs=options.jobs, show=options.show)


def specs_of(options: WorldOptions) -> list[WalkSpec]:
    """What each robot of the options walks."""
    plant = with_options(load_plant(options.plant), options.plant_options)
    return [
        WalkSpec(
            scene=options.scene, seed=options.seed + number, seconds=options.window,
            urdf=options.urdf, engine=options.engine, plant=plant,
        )
        for number in range(options.robots)
    ]  # fmt: skip


def first_trials(
    options: WorldOptions, walked: Sequence[WalkSamples], head: HeadMode = HeadMode.AUTO
) -> list[WorldTrace]:
    """A trial of each robot from a known start: over these walks, or with rendered images."""
    if options.vision == "model":
        return trials(options, walked, head=head)
    run = partial(run_rendered, head=head)
    return parallel_map(
        run, specs_of(options), jobs=options.jobs, label="rendered", show=options.show
    )


def trials(
    options: WorldOptions, walked: Sequence[WalkSamples], kind: str = "known", **changes: object
) -> list[WorldTrace]:
    """Trials over each walk; `changes` are of their specification."""
    base = WorldTrialSpec(scene=options.scene, urdf=options.urdf)
    jobs = [
        Job(
            kind,
            replace(
                base,
                seed=options.seed + number + REPEAT_SEED * repeat,
                **changes,  # type: ignore[arg-type]
            ),
            (walk, walked[(number + 1) % len(walked)]),
        )
        for repeat in range(options.repeats)
        for number, walk in enumerate(walked)
    ]
    return parallel_map(run_job, jobs, jobs=options.jobs, label=kind, show=options.show)


def delayed(
    options: WorldOptions,
    walked: Sequence[WalkSamples],
    score: Callable[[Sequence[WorldTrace]], Score],
    head: HeadMode = HeadMode.AUTO,
) -> dict[str, Score]:
    """The scores with other delays of the images, by what is delayed; the ablation.

    Empty if the options leave it out or there are no recorded walks.
    """
    if not (walked and options.ablation):
        return {}
    scores = {
        f"{1e3 * delay:.0f} ms": score(trials(options, walked, delay=delay, head=head))
        for delay in DELAYS
    }
    late = trials(options, walked, delay=IGNORED, knows_delay=False, head=head)
    return {**scores, f"{1e3 * IGNORED:.0f} ms, ignored": score(late)}


def delay_rows(
    scores: Mapping[str, Score], read: Mapping[str, tuple[str, Callable[[Score], float]]]
) -> list[Measurement]:
    """The metrics of the ablation.

    Args:
        scores: Of `delayed`.
        read: End of a metric's name -> its unit, and its value by a score.
    """
    return [
        Measurement(f"delay_{name.replace(' ms', '_ms').replace(', ', '_')}_{end}", unit, of(score))
        for name, score in scores.items()
        for end, (unit, of) in read.items()
    ]


def percepts_title(options: WorldOptions) -> str:
    """Where the percepts of the options come from, for titles."""
    return "rendered images" if options.vision == "camera" else "percepts by the measured model"


def run_job(job: Job) -> WorldTrace:
    """The trace of one trial; one with a gap ends when the pose should have been found."""
    walk, other = job.walks
    spec, start = job.spec, float(walk.stamp[0]) * 1e-9 + GAP_TIME
    if job.kind == "carried":
        walk = spliced(walk, other, GAP_TIME, CARRY)
        spec = replace(spec, gap=Gap(start, start + CARRY, fall=False), mate=True)
    elif job.kind == "fall":
        turn = np.random.default_rng((job.spec.seed, 5)).uniform(-FALL_TURN, FALL_TURN)
        walk = turned_after(walk, GAP_TIME, LIE, turn)
        spec = replace(spec, gap=Gap(start, start + LIE, fall=True))
    if spec.gap is not None:
        walk = walk.until(spec.gap.end - start + GAP_TIME + FOUND_AFTER + 2.0)
    return run_trial(spec, walk)


# -- own pose --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PoseScore:
    """Errors of the own pose over some trials.

    Attributes:
        median: [cm] of the place.
        p95: [cm]
        heading: [deg] median.
        heading_p95: [deg]
        valid: [%] of the time.
        valid_wrong: [%] of the valid time in which the place is over `WRONG` off.
        inside: [%] of the valid time in which the truth is in the 95 % ellipsoid.
        wrong_half: Number of trials that end in the wrong half.
        cost: [ms] median for each image.
    """

    median: float
    p95: float
    heading: float
    heading_p95: float
    valid: float
    valid_wrong: float
    inside: float
    wrong_half: int
    cost: float


def pose_score(traces: Sequence[WorldTrace]) -> PoseScore:
    """The score of all images of some trials, after the start."""
    place = _joined(traces, lambda t: t.place_error)
    heading = np.degrees(_joined(traces, lambda t: t.heading_error))
    valid = _joined(traces, lambda t: t.valid).astype(bool)
    inside = _joined(traces, pose_deviation) < INSIDE_95
    share = max(1, int(valid.sum()))
    return PoseScore(
        100.0 * float(np.median(place)),
        100.0 * float(np.percentile(place, 95)),
        float(np.median(heading)),
        float(np.percentile(heading, 95)),
        100.0 * float(valid.mean()),
        100.0 * float((valid & (place > WRONG)).sum()) / share,
        100.0 * float((valid & inside).sum()) / share,
        sum(bool(trace.in_wrong_half[-1]) for trace in traces),
        1e3 * float(np.median(_joined(traces, lambda t: t.cost))),
    )


def pose_deviation(trace: WorldTrace) -> FloatArray:
    """(n,) squared deviations of the truth from the estimate, by its covariance."""
    error = trace.pose - trace.truth
    error[:, 2] = np.remainder(error[:, 2] + math.pi, math.tau) - math.pi
    xx, xy, yy, xt, yt, tt = trace.covariance.T
    full = np.stack((np.stack((xx, xy, xt)), np.stack((xy, yy, yt)), np.stack((xt, yt, tt))))
    solved = np.linalg.solve(full.transpose(2, 0, 1), error[:, :, None])[:, :, 0]
    result: FloatArray = np.einsum("ni,ni->n", error, solved)
    return result


def right_again(trace: WorldTrace, after: float) -> float:
    """[s] From `after` [s since the first image] until the pose is valid and right for a second.

    Infinite if it never is.
    """
    since = trace.time - trace.time[0] - after
    right = trace.valid & (trace.place_error < RIGHT[0]) & (trace.heading_error < RIGHT[1])
    for index in np.flatnonzero((since >= 0.0) & right):
        next_second = (trace.time >= trace.time[index]) & (trace.time <= trace.time[index] + 1.0)
        if right[next_second].mean() > 0.9:
            return float(since[index])
    return math.inf


def _joined(traces: Sequence[WorldTrace], read: Callable[[WorldTrace], Any]) -> Any:
    """A column of all trials, without the time in which they begin."""
    return np.concatenate(
        [read(trace)[trace.time - trace.time[0] > SETTLED] for trace in traces]
    )


# -- ball ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BallScore:
    """Errors of the ball within `NEAR`, while it was seen recently.

    Attributes:
        known: [%] of the time.
        median: [cm] of the place.
        p95: [cm]
        velocity: [cm/s] median, of a ball that rolls.
        velocity_p95: [cm/s]
        rest: [cm/s] 95 % of the speeds of a ball that rests.
        inside: [%] of the time in which the truth is in the 95 % ellipse.
    """

    known: float
    median: float
    p95: float
    velocity: float
    velocity_p95: float
    rest: float
    inside: float


def ball_score(traces: Sequence[WorldTrace]) -> BallScore:
    """The score of all images of some trials."""
    truth, estimate = (
        _joined(traces, lambda t: t.ball_truth), _joined(traces, lambda t: t.ball),
    )  # fmt: skip
    age = _joined(traces, lambda t: t.ball_age)
    near = np.hypot(*truth[:, :2].T) < NEAR
    known = near & _joined(traces, lambda t: t.ball_recent).astype(bool)
    # A ball that was just put down or kicked is another one than that which was seen.
    settled = known & (age > ROLLED_FOR)
    error = estimate - truth
    place, speed = np.hypot(*error[:, :2].T), np.hypot(*error[:, 2:].T)
    rolls = np.hypot(*truth[:, 2:].T) > ROLLING
    xx, xy, yy = _joined(traces, lambda t: t.ball_covariance)[settled].T
    dx, dy = error[settled, :2].T
    square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
    return BallScore(
        100.0 * float(known.sum()) / max(1, int(near.sum())),
        100.0 * _percentile(place[settled], 50),
        100.0 * _percentile(place[settled], 95),
        100.0 * _percentile(speed[settled & rolls], 50),
        100.0 * _percentile(speed[settled & rolls], 95),
        100.0 * _percentile(np.hypot(*estimate[settled & ~rolls, 2:].T), 95),
        100.0 * float((square < 5.991).mean()) if len(square) else math.nan,
    )


def _percentile(values: FloatArray, share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else math.nan
