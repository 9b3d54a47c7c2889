"""The suites of the world model, on walks of random commands: `localization` and `ball`."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from gait_lab.bench.options import SHARED, Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.soccer.field_walks import WalkSamples, WalkSpec, record
from gait_lab.soccer.world_trial import (
    Gap,
    WorldTrace,
    WorldTrialSpec,
    run_rendered,
    run_trial,
    spliced,
    turned_after,
)
from nao_soccer.world.state import HeadMode
from robot_core.geometry import wrapped
from robot_core.types import FloatArray

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
INSIDE_95_2, INSIDE_95_3 = 5.991, 7.815
"""Squared deviations that 95 % of the errors of two and of three variables do not exceed."""
NEAR = 2.0
"""[m] Balls that are nearer count."""
ROLLING, ROLLED_FOR = 0.05, 0.5
"""[m/s, s] A ball that rolls faster, for at least this long."""
DELAYS = (0.0, 0.1, 0.3)
"""[s] Delays of the images of the ablation; the longest is run again unknown to the filters."""
OPTIONS = {
    "robots": replace(SHARED["robots"], default=20, maximum=1000),
    "window": Option(60.0, "time that each robot walks [s]", "T", ("--seconds",), minimum=4.0,
                     maximum=3600.0),
    "scene": ...,
    "ablation": Option(True, "the measured delay only", "", ("--no-ablation",)),
    "vision": Option("model", "percepts by the measured model, or from rendered images", "KIND",
                     choices=("model", "camera")),
}  # fmt: skip
QUICK = ({"robots": 2, "window": 30.0, "ablation": False},)
Scores = dict[str, tuple[str, float]]
"""Quantity -> unit and value."""


class Walks:
    """A recorded walk of each robot, or none for rendered images, and trials over them."""

    def __init__(self, options: Options, head: HeadMode) -> None:
        self._options, self._head = options, head
        self._specs = [
            WalkSpec(scene=options.scene, seed=seed, seconds=options.window, **options.play)
            for seed in options.seeds
        ]  # fmt: skip
        self.walked: list[WalkSamples] = []
        if options.vision == "model":
            self.walked = options.map(record, self._specs, label="walks")

    def first(self) -> list[WorldTrace]:
        """A trial of each robot from a known start."""
        if self.walked:
            return self.trials()
        run = partial(run_rendered, head=self._head)
        return self._options.map(run, self._specs, label="rendered")

    def trials(self, kind: str = "known", **changes: Any) -> list[WorldTrace]:
        """Trials over each walk.

        Args:
            kind: `known`, `carried` or `fall`: what happens on the way.
            changes: Of their specification.
        """
        options = self._options
        base = WorldTrialSpec(scene=options.scene, urdf=options.urdf)
        jobs = [
            (kind, replace(base, seed=options.seed + number, head=self._head, **changes),
             walk, self.walked[(number + 1) % len(self.walked)])
            for number, walk in enumerate(self.walked)
        ]  # fmt: skip
        return options.map(run_job, jobs, label=kind)

    def delayed(
        self, score: Callable[[Sequence[WorldTrace]], Scores], *shown: str
    ) -> Iterator[Row]:
        """These scores with other delays of the images, if the options ask for the ablation."""
        if not (self.walked and self._options.ablation):
            return
        cases: list[tuple[str, dict[str, Any]]] = [
            (f"{1e3 * delay:.0f}_ms", {"delay": delay}) for delay in DELAYS
        ]
        cases.append((f"{cases[-1][0]}_ignored", {"delay": DELAYS[-1], "knows_delay": False}))
        for name, changes in cases:
            found = score(self.trials(**changes))
            for quantity in shown:
                short = quantity.removeprefix("ball_")
                yield Row(f"delay_{name}", short, *found[quantity])


def run_job(job: tuple[str, WorldTrialSpec, WalkSamples, WalkSamples]) -> WorldTrace:
    """The trace of one trial; one with a gap ends when the pose should have been found."""
    kind, spec, walk, other = job
    start = float(walk.stamp[0]) * 1e-9 + GAP_TIME
    if kind == "carried":
        walk = spliced(walk, other, GAP_TIME, CARRY)
        spec = replace(spec, gap=Gap(start, start + CARRY, fall=False), mate=True)
    elif kind == "fall":
        turn = np.random.default_rng((spec.seed, 5)).uniform(-FALL_TURN, FALL_TURN)
        walk = turned_after(walk, GAP_TIME, LIE, turn)
        spec = replace(spec, gap=Gap(start, start + LIE, fall=True))
    if spec.gap is not None:
        walk = walk.until(spec.gap.end - start + GAP_TIME + FOUND_AFTER + 2.0)
    return run_trial(spec, walk)


def _joined(traces: Sequence[WorldTrace], read: Callable[[WorldTrace], Any]) -> Any:
    """A column of all trials, without the time in which they begin."""
    return np.concatenate(
        [read(trace)[trace.time - trace.time[0] > SETTLED] for trace in traces]
    )


def _percentile(values: FloatArray, share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else math.nan


# -- own pose --------------------------------------------------------------------------------------


def pose_scores(traces: Sequence[WorldTrace]) -> Scores:
    """Errors of the own pose in all images of some trials, after the start."""
    place = 100.0 * _joined(traces, lambda t: t.place_error)
    heading = np.degrees(_joined(traces, lambda t: t.heading_error))
    valid = _joined(traces, lambda t: t.valid).astype(bool)
    inside = _joined(traces, pose_deviation) < INSIDE_95_3
    share = max(1, int(valid.sum()))
    return {
        "pose_error_median": ("cm", float(np.median(place))),
        "pose_error_p95": ("cm", float(np.percentile(place, 95))),
        "heading_error_median": ("deg", float(np.median(heading))),
        "heading_error_p95": ("deg", float(np.percentile(heading, 95))),
        "valid_share": ("%", 100.0 * float(valid.mean())),
        "valid_wrong_share": (
            "%", 100.0 * float((valid & (place > 100.0 * WRONG)).sum()) / share
        ),
        "inside_ellipse_share": ("%", 100.0 * float((valid & inside).sum()) / share),
        "wrong_half": ("trials", sum(bool(trace.in_wrong_half[-1]) for trace in traces)),
    }  # fmt: skip


def pose_deviation(trace: WorldTrace) -> FloatArray:
    """(n,) squared deviations of the truth from the estimate, by its covariance."""
    error = trace.pose - trace.truth
    error[:, 2] = wrapped(error[:, 2])
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


@suite(
    "localization", "Self-localisation",
    "the own pose against the truth: walks, robots that are carried away, falls, delays",
    options=OPTIONS, gait=False, quick=QUICK,
)  # fmt: skip
def localization(options: Options) -> Iterator[Row | str]:
    """Known starts, robots that are carried away, falls, and delays."""
    walked = Walks(options, HeadMode.AUTO)
    for name, (unit, value) in pose_scores(walked.first()).items():
        yield Row("", name, unit, value)
    if walked.walked and options.window > GAP_TIME:
        carried = [right_again(t, GAP_TIME + CARRY) for t in walked.trials("carried")]
        fallen = [right_again(t, GAP_TIME + LIE) for t in walked.trials("fall")]
        yield from rows_of(
            "",
            ("kidnap_seconds_median", "s", float(np.median(carried))),
            ("kidnap_seconds_p90", "s", float(np.percentile(carried, 90, method="higher"))),
            ("kidnap_found", "%", 100.0 * float(np.mean(np.isfinite(carried)))),
            ("fall_found", "%",
             100.0 * float(np.mean([each <= FOUND_AFTER for each in fallen]))),
            ("fall_seconds_median", "s", float(np.median(fallen))),
        )  # fmt: skip
    yield from walked.delayed(pose_scores, "pose_error_median", "heading_error_median")
    yield (
        f"Random walks of {options.window:g} s from a known start. valid wrong: of the valid time, "
        f"with an error over {WRONG:g} m. inside ellipse: of the valid time, the truth is in the "
        f"95 % ellipsoid of the covariance. kidnap: carried {CARRY:g} s to the start of another "
        "walk, unnoticed by odometry; a team mate tells of the ball. fall: "
        f"{LIE:g} s without images, then turned by up to {math.degrees(FALL_TURN):.0f} deg; found "
        f"within {FOUND_AFTER:g} s. Right: valid, within {RIGHT[0]:g} m and "
        f"{math.degrees(RIGHT[1]):.0f} deg, for a second."
    )


# -- ball ------------------------------------------------------------------------------------------


def ball_scores(traces: Sequence[WorldTrace]) -> Scores:
    """Errors of the ball within `NEAR`, while it was seen recently, in all images."""
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
    rolls = settled & (np.hypot(*truth[:, 2:].T) > ROLLING)
    at_rest = np.hypot(*estimate[settled & ~rolls, 2:].T)
    xx, xy, yy = _joined(traces, lambda t: t.ball_covariance)[settled].T
    dx, dy = error[settled, :2].T
    square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
    inside = 100.0 * float((square < INSIDE_95_2).mean()) if len(square) else math.nan
    return {
        "ball_position_error_median": ("cm", 100.0 * _percentile(place[settled], 50)),
        "ball_position_error_p95": ("cm", 100.0 * _percentile(place[settled], 95)),
        "ball_velocity_error_median": ("cm/s", 100.0 * _percentile(speed[rolls], 50)),
        "ball_velocity_error_p95": ("cm/s", 100.0 * _percentile(speed[rolls], 95)),
        "ball_at_rest_speed_p95": ("cm/s", 100.0 * _percentile(at_rest, 95)),
        "ball_known_share": ("%", 100.0 * float(known.sum()) / max(1, int(near.sum()))),
        "ball_inside_ellipse_share": ("%", inside),
    }


@suite(
    "ball", "Ball", "place and velocity of a ball against the truth, and delays",
    options=OPTIONS, gait=False, quick=QUICK,
)  # fmt: skip
def ball(options: Options) -> Iterator[Row | str]:
    """A ball that rests, rolls and is put elsewhere, seen by a robot that walks."""
    walked = Walks(options, HeadMode.BALL)
    for name, (unit, value) in ball_scores(walked.first()).items():
        yield Row("", name, unit, value)
    yield from walked.delayed(
        ball_scores, "ball_position_error_median", "ball_velocity_error_median"
    )
    yield (
        f"A ball within {NEAR:g} m of robots that walk for {options.window:g} s. known: the ball "
        "was seen within the last second. Errors are those of a known ball in images from "
        f"{ROLLED_FOR:g} s after it was put down or kicked; velocity: of a ball that rolls; at "
        "rest: the speed that a ball at rest seems to have."
    )
