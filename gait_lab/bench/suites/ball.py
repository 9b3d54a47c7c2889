"""The suite `ball`: the ball filter while robots walk random commands on a field."""

from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.bench.world_scores import (
    NEAR,
    ROLLED_FOR,
    BallScore,
    WorldOptions,
    ball_score,
    delay_rows,
    delayed,
    first_trials,
    percepts_title,
    walks_of,
)
from nao_soccer.world.state import HeadMode


def ball(options: WorldOptions) -> SuiteResult:
    """A ball that rests, rolls and is put elsewhere, seen by a robot that walks."""
    walks, head = walks_of(options), HeadMode.BALL
    measured = ball_score(first_trials(options, walks, head))
    rows = [
        Measurement("ball_position_error_median", "cm", measured.median),
        Measurement("ball_position_error_p95", "cm", measured.p95),
        Measurement("ball_velocity_error_median", "cm/s", measured.velocity),
        Measurement("ball_velocity_error_p95", "cm/s", measured.velocity_p95),
        Measurement("ball_at_rest_speed_p95", "cm/s", measured.rest),
        Measurement("ball_known_share", "%", measured.known),
        Measurement("ball_inside_ellipse_share", "%", measured.inside),
    ]
    late = delayed(options, walks, ball_score, head)
    rows += delay_rows(
        late,
        {
            "position_error_median": ("cm", lambda score: score.median),
            "velocity_error_median": ("cm/s", lambda score: score.velocity),
        },
    )
    scores = [("as measured", measured), *late.items()]
    columns = (
        Column("delay"), Column("known", "%"), Column("place", "cm, median"), Column("95 %", "cm"),
        Column("velocity", "cm/s, median"), Column("95 %", "cm/s"), Column("at rest", "cm/s, 95 %"),
        Column("in ellipse", "%"),
    )  # fmt: skip
    return SuiteResult(
        tuple(rows),
        f"A ball within {NEAR:g} m of robots that walk for {options.window:g} s on "
        f"{options.scene}, {percepts_title(options)}; {options.title}",
        (Table(columns, [_line(name, score) for name, score in scores]),),
        (
            "known: the ball was seen within the last second. Errors are those of a known ball in "
            f"images from {ROLLED_FOR:g} s after it was put down or kicked; velocity: of a ball "
            "that rolls; at rest: the speed that a ball at rest seems to have.",
        ),
    )


def _line(name: str, score: BallScore) -> list[str | float | None]:
    return [
        name, score.known, score.median, score.p95, score.velocity, score.velocity_p95,
        score.rest, score.inside,
    ]  # fmt: skip


SUITE = Suite(
    name="ball",
    title="Ball",
    summary="place and velocity of a ball against the truth, and delays",
    measure=ball,
    options=WorldOptions,
    takes=("robots", "window"),
    gait=False,
    quick=({"robots": 2, "window": 30.0, "ablation": False},),
)
