"""The suite `localization`: the own pose while robots walk random commands on a field."""

import math

import numpy as np

from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.bench.world_scores import (
    CARRY,
    FALL_TURN,
    FOUND_AFTER,
    GAP_TIME,
    LIE,
    RIGHT,
    WRONG,
    PoseScore,
    WorldOptions,
    delay_rows,
    delayed,
    first_trials,
    percepts_title,
    pose_score,
    right_again,
    trials,
    walks_of,
)
from gait_lab.soccer.field_walks import WalkSamples


def localization(options: WorldOptions) -> SuiteResult:
    """Known starts, robots that are carried away, falls, and delays."""
    walks = walks_of(options)
    measured = pose_score(first_trials(options, walks))
    rows = [
        Measurement("pose_error_median", "cm", measured.median),
        Measurement("pose_error_p95", "cm", measured.p95),
        Measurement("heading_error_median", "deg", measured.heading),
        Measurement("heading_error_p95", "deg", measured.heading_p95),
        Measurement("valid_share", "%", measured.valid),
        Measurement("valid_wrong_share", "%", measured.valid_wrong),
        Measurement("inside_ellipse_share", "%", measured.inside),
        Measurement("wrong_half", "trials", measured.wrong_half),
    ]
    if walks and options.window > GAP_TIME:
        rows += _found_again(options, walks)
    late = delayed(options, walks, pose_score)
    rows += delay_rows(
        late,
        {
            "pose_error_median": ("cm", lambda score: score.median),
            "heading_error_median": ("deg", lambda score: score.heading),
        },
    )
    scores = [("as measured", measured), *late.items()]
    columns = (
        Column("delay"), Column("place", "cm, median"), Column("95 %", "cm"),
        Column("heading", "deg, median"), Column("95 %", "deg"), Column("valid", "%"),
        Column("valid but", "wrong, %", 2), Column("in ellipse", "%"),
        Column("wrong half", "trials"), Column("update", "ms", 2),
    )  # fmt: skip
    table = Table(columns, [_line(name, score) for name, score in scores])
    return SuiteResult(
        tuple(rows),
        f"Random walks of {options.window:g} s on {options.scene} from a known start, "
        f"{percepts_title(options)}; {options.title}",
        (table, *_again_table(rows)),
        (
            f"valid but wrong: of the valid time, with an error over {WRONG:g} m. in ellipse: of "
            "the valid time, the truth is in the 95 % ellipsoid of the covariance.",
            f"carried: {CARRY:g} s to the start of another walk, unnoticed by odometry; a team "
            f"mate tells of the ball. fall: {LIE:g} s without images, then turned by up to "
            f"{math.degrees(FALL_TURN):.0f} deg. Right: valid, within {RIGHT[0]:g} m and "
            f"{math.degrees(RIGHT[1]):.0f} deg, for a second.",
        ),
    )


def _found_again(options: WorldOptions, walks: list[WalkSamples]) -> list[Measurement]:
    carried = [right_again(t, GAP_TIME + CARRY) for t in trials(options, walks, "carried")]
    fallen = [right_again(t, GAP_TIME + LIE) for t in trials(options, walks, "fall")]
    found = float(np.mean([each <= FOUND_AFTER for each in fallen]))
    last = float(np.percentile(carried, 90, method="higher"))
    return [
        Measurement("kidnap_seconds_median", "s", _finite(float(np.median(carried)))),
        Measurement("kidnap_seconds_p90", "s", _finite(last)),
        Measurement("kidnap_found", "%", 100.0 * float(np.mean(np.isfinite(carried)))),
        Measurement("fall_found", "%", 100.0 * found),
        Measurement("fall_seconds_median", "s", _finite(float(np.median(fallen)))),
    ]


def _again_table(rows: list[Measurement]) -> tuple[Table, ...]:
    names = ("kidnap_seconds_median", "kidnap_seconds_p90", "kidnap_found", "fall_found",
             "fall_seconds_median")  # fmt: skip
    by_name = {row.metric: row.value for row in rows}
    if names[0] not in by_name:
        return ()
    columns = (
        Column("carried:", "median, s"), Column("90 %", "s"), Column("found", "%"),
        Column("fall: found", f"in {FOUND_AFTER:g} s, %"), Column("median", "s"),
    )  # fmt: skip
    return (Table(columns, [[by_name[name] for name in names]]),)


def _line(name: str, score: PoseScore) -> list[str | float | None]:
    return [
        name, score.median, score.p95, score.heading, score.heading_p95, score.valid,
        score.valid_wrong, score.inside, score.wrong_half, score.cost,
    ]  # fmt: skip


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


SUITE = Suite(
    name="localization",
    title="Self-localisation",
    summary="the own pose against the truth: walks, robots that are carried away, falls, delays",
    measure=localization,
    options=WorldOptions,
    takes=("robots", "window"),
    gait=False,
    quick=({"robots": 2, "window": 30.0, "ablation": False},),
)
