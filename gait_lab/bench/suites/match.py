"""The suite `match`: matches of two teams in one process, with percepts by the model."""

import statistics
from collections.abc import Iterator

from gait_lab.bench.options import MOST_ROBOTS, Option, Options
from gait_lab.bench.policies import NAMES, POLICIES, policies
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median, percent, standard_error
from gait_lab.soccer.match import MatchResult, MatchSpec, play_match

SILENCE_FROM = 25.0
"""[s] from which on the referee is silent; the ball is in play then."""


@suite(
    "match", "Matches", "goals, falls and roles in matches of two teams",
    options={
        "robots": Option(10, "number of matches", "N", ("--matches", "--robots"), minimum=1,
                         maximum=MOST_ROBOTS),
        "minutes": Option(2.0, "simulated minutes of a half", "M", minimum=0.1, maximum=60.0),
        "scene": ...,
        "loss": Option(0.0, "share of team messages that are lost", "P", minimum=0.0, maximum=1.0),
        "silence": Option(
            0.0, "the referee is not heard for this time [s] of the first half", "T", minimum=0.0
        ),
        **POLICIES,
        "red_alone": Option(False, "team red plays without roles"),
        "resume": ...,
    },
    gait=False, quick=({"robots": 2, "minutes": 1.0},), check=policies,
    epilog=NAMES,
)  # fmt: skip
def matches(options: Options) -> Iterator[Row | str]:
    """Play the matches; each has other individuals.

    With two policies the judged team is red in every other pair of matches, blue in the others, and
    has the kick-off in half of each.
    """
    mine, other = policies(options)
    silence = (SILENCE_FROM, SILENCE_FROM + options.silence) if options.silence else None
    specs = [
        MatchSpec(
            scene=options.scene, minutes=options.minutes, seed=seed, loss=options.loss,
            without_roles=("red",) if options.red_alone else (), frames=False, silence=silence,
            red=mine if _is_red(seed) else other, blue=other if _is_red(seed) else mine,
            **options.play,
        )
        for seed in options.seeds
    ]  # fmt: skip
    results: list[MatchResult] = options.map(
        play_match, specs, label="matches",
        note=lambda each: f"seed {each.spec.seed}: {each.score['red']} : {each.score['blue']}",
        restore=MatchResult.restored,
    )  # fmt: skip
    robot_minutes = sum(each.seconds for each in results) / 60.0 * len(results[0].falls)
    playing = sum(each.playing or 0.0 for each in results)
    still = sum((each.playing or 0.0) * (each.rest or 0.0) for each in results)
    duels = [duel for each in results for duel in each.duels]
    red, blue = (sum(each.score[team] for each in results) for team in ("red", "blue"))
    yield from rows_of(
        "",
        ("goals_per_match", "goals", (red + blue) / len(results)),
        ("goals_per_minute_of_play", "1/min", 60.0 * (red + blue) / playing if playing else None),
        ("goals_red", "goals", red),
        ("goals_blue", "goals", blue),
        ("falls_per_robot_minute", "1/min",
         sum(sum(each.falls.values()) for each in results) / robot_minutes),
        ("kicks_per_robot_minute", "1/min", sum(each.kicks for each in results) / robot_minutes),
        ("strokes_per_robot_minute", "1/min",
         sum(each.strokes for each in results) / robot_minutes),
        ("ball_rest", "%", 100.0 * still / playing if playing else None),
        ("duel_median", "s", median(duels)),
        ("duel_longest", "s", max(duels, default=None)),
        ("own_goals", "goals", sum(each.own_goals for each in results)),
        ("wrong_half", "goals", sum(each.wrong_half for each in results)),
        ("one_striker", "%", percent(each.one_striker for each in results)),
        ("role_conflict_seconds_max", "s", max(each.conflict for each in results)),
    )  # fmt: skip
    if mine != other:
        points = [
            0.5 + 0.5 * _sign(score["red"] - score["blue"]) * (1 if _is_red(each.spec.seed) else -1)
            for each in results for score in (each.score,)
        ]  # fmt: skip
        yield Row("", "policy_points", "%", 100.0 * statistics.fmean(points))
    more = [each.score["blue"] - each.score["red"] for each in results]
    yield (
        f"Goals of blue minus those of red: {statistics.fmean(more):.2f} a match, standard error "
        f"{standard_error(more):.2f}. kicks: motions of a standing robot; strokes: of dribbling "
        "robots. own goals: a defender touched the ball last; wrong half: and took its own goal "
        "for the opponents'. one striker: share of the playing time in which a team has exactly "
        "one; conflict: longest time with two. ball rest: share of the play with the ball slower "
        "than 0.03 m/s. duel: robots of both teams within 0.5 m of the ball for 1 s or more."
    )


def _is_red(seed: int) -> bool:
    """Whether the judged team is red; the kick-off is red's at even seeds."""
    return seed // 2 % 2 == 0


def _sign(value: int) -> int:
    return (value > 0) - (value < 0)
