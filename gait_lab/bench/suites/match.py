"""The suite `match`: matches of two teams in one process, with percepts by the model."""

import math
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, keep_option, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.soccer.match import MatchResult, MatchSpec, play_match
from sim_bridge.plant import load_plant, with_options
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.result_cache import ResultCache

SILENCE_FROM = 25.0
"""[s] from which on the referee is silent; the ball is in play then."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `match` runs on; `--robots` is the number of matches."""

    robots: int = option(10, "number of matches", "N", flags=("--matches", "--robots"), minimum=1)
    minutes: float = option(2.0, "simulated minutes of a half", "M", minimum=0.05, maximum=60.0)
    scene: str = option("pitch_small", "field and robots: a shipped scene or a YAML file", "S")
    loss: float = option(0.0, "share of team messages that are lost", "P", minimum=0.0, maximum=1.0)
    silence: float = option(
        0.0, "the referee is not heard for this time [s] of the first half", "T", minimum=0.0
    )
    red_alone: bool = option(False, "team red plays without roles")
    keep: str = keep_option()


def matches(options: Options) -> SuiteResult:
    """Play the matches; each has other individuals."""
    specs = [
        MatchSpec(
            scene=options.scene,
            minutes=options.minutes,
            seed=seed,
            engine=options.engine,
            plant=with_options(load_plant(options.plant), options.plant_options),
            urdf=options.urdf,
            loss=options.loss,
            without_roles=("red",) if options.red_alone else (),
            frames=False,
            silence=(SILENCE_FROM, SILENCE_FROM + options.silence) if options.silence else None,
        )
        for seed in options.seeds
    ]
    results: list[MatchResult] = parallel_map(
        play_match, specs, jobs=options.jobs, label="matches", show=options.show, note=_note,
        kept=ResultCache(options.keep, MatchResult.restored) if options.keep else None,
    )  # fmt: skip
    count = len(results)
    minutes = sum(result.seconds for result in results) / 60.0
    robots = len(results[0].falls)
    red, blue = (sum(result.score[team] for result in results) for team in ("red", "blue"))
    falls = sum(sum(result.falls.values()) for result in results)
    wrong = sum(result.wrong_half for result in results)
    own = sum(result.own_goals for result in results)
    conflict = max(result.conflict for result in results)
    one = 100.0 * sum(result.one_striker for result in results) / count
    kicks = sum(result.kicks for result in results) / (minutes * robots)
    strokes = sum(result.strokes for result in results) / (minutes * robots)
    difference = [result.score["blue"] - result.score["red"] for result in results]
    rows = (
        Measurement("goals_per_match", "goals", (red + blue) / count),
        Measurement("goals_red", "goals", red),
        Measurement("goals_blue", "goals", blue),
        Measurement("falls_per_robot_minute", "1/min", falls / (minutes * robots)),
        Measurement("kicks_per_robot_minute", "1/min", kicks),
        Measurement("strokes_per_robot_minute", "1/min", strokes),
        Measurement("own_goals", "goals", own),
        Measurement("wrong_half", "goals", wrong),
        Measurement("one_striker", "%", one),
        Measurement("role_conflict_seconds_max", "s", conflict),
    )
    columns = (
        Column("matches"), Column("red", "goals"), Column("blue", "goals"),
        Column("goals", "a match", 1), Column("falls", "per robot and minute", 2),
        Column("kicks", "likewise", 2), Column("strokes", "likewise", 2), Column("own goals"),
        Column("wrong half", "goals"), Column("one striker", "%"),
        Column("longest conflict", "s"),
    )  # fmt: skip
    line = (
        count, red, blue, (red + blue) / count, falls / (minutes * robots), kicks, strokes, own,
        wrong, one, conflict,
    )  # fmt: skip
    spread = _deviation(difference) / math.sqrt(count)
    notes = (
        f"{options.minutes:g} simulated minutes a half. Goals of blue minus those of red: "
        f"{sum(difference) / count:.2f} a match, standard error {spread:.2f}.",
        "kicks: motions of a standing robot; strokes: of dribbling robots. own goals: a defender "
        "touched the ball last; wrong half: and took its own goal for the opponents'. one "
        "striker: share of the playing time in which a team has exactly one; "
        "conflict: longest time with two.",
    )
    title = f"Matches; {options.title}, {options.scene}"
    return SuiteResult(rows, title, (Table(columns, [line]),), notes)


def _deviation(values: list[int]) -> float:
    mean = sum(values) / len(values)
    return math.sqrt(sum((each - mean) ** 2 for each in values) / max(1, len(values) - 1))


def _note(result: MatchResult) -> str:
    return f"seed {result.spec.seed}: {result.score['red']} : {result.score['blue']}"


SUITE = Suite(
    name="match",
    title="Matches",
    summary="goals, falls and roles in matches of two teams",
    measure=matches,
    options=Options,
    takes=("robots",),
    gait=False,
    quick=({"robots": 2, "minutes": 1.0},),
)
