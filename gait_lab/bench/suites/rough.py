"""The suite `rough`: which walks cross the second paper's field of hexagonal plates, and how fast.

Each robot walks on a field of its own. Bruno's two published walks, beside the walks for level
ground as they are. Open loop means that no sensor changes the walk, eq. (7) included.
"""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, loop_name
from gait_lab.bench.suite import Suite
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.presets import preset_for
from robot_core.errors import NaoGaitError
from sim_bridge.trials.crossing import CrossingResult, CrossingRobot, CrossingSpec, cross
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.tasks import find_task
from sim_bridge.trials.trial import loaded_robot

PAPER_SLOW, PAPER_FAST = 45.0, 7.5
"""[s] published, over 1 m; how often it succeeded is not published."""
WALKERS = (
    # sequences of 8 short steps with a pause after each; low and fast
    CrossingRobot("bruno_slow", "bruno", "rough_slow", "spring", 0.0714, 5.6, 1.5, PAPER_SLOW),
    CrossingRobot("bruno_fast", "bruno", "rough_fast", "sponge", 0.20, paper=PAPER_FAST),
    CrossingRobot("bruno_level", "bruno", "bruno", "own", 0.24),
    CrossingRobot("nao_level", "nao_h21_v33", "default", "own", 0.20),
)
"""`level`: the walk for level ground."""
GIVEN = "given"
"""The walk of the command line, at the speed of its task, on the robot's own soles."""
ENDS = ("crossed", "fell", "left", "late")


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `rough` runs on."""

    robots: int = 20
    tasks: tuple[str, ...] = ("forward=20",)
    experiments: tuple[str, ...] = option(
        (), "only this walk: bruno_slow, bruno_fast, bruno_level, nao_level, or given (by --robot, "
        "--preset, --set, --task)", "NAME", flags=("--experiment",),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Crossings:
    """All attempts of one walk in closed or open loop.

    Attributes:
        walker: Robot, soles and walk.
        closed_loop: Whether the gait had its feedback.
        results: One per robot.
    """

    walker: CrossingRobot
    closed_loop: bool
    results: Sequence[CrossingResult]

    def count(self, end: str) -> int:
        """The number of attempts with this end."""
        return sum(result.end == end for result in self.results)

    @property
    def share(self) -> float:
        """Of the attempts that crossed [%]."""
        return 100.0 * self.count("crossed") / len(self.results)

    @property
    def times(self) -> list[float]:
        """[s] of the attempts that crossed."""
        return [result.seconds for result in self.results if result.seconds is not None]

    @property
    def median(self) -> float | None:
        """Median of the times [s]."""
        return statistics.median(self.times) if self.times else None

    @property
    def way(self) -> float:
        """Mean distance that was walked on the field [m]."""
        return statistics.fmean(result.way for result in self.results)

    @property
    def rows(self) -> list[Measurement]:
        """The measurements."""
        name = self.walker.name if self.closed_loop else f"{self.walker.name}_open_loop"
        return [
            Measurement(f"{name}_runs", "runs", len(self.results)),
            *(Measurement(f"{name}_{end}", "runs", self.count(end)) for end in ENDS),
            Measurement(f"{name}_crossed_share", "%", self.share),
            Measurement(f"{name}_time_median", "s", self.median, self.walker.paper),
            Measurement(f"{name}_time_worst", "s", max(self.times, default=None)),
            Measurement(f"{name}_way_mean", "m", self.way),
        ]

    @property
    def line(self) -> tuple[TableCell, ...]:
        """The row of the table."""
        return (
            self.walker.name.replace("_", " "), loop_name(self.closed_loop),
            *(self.count(end) for end in ENDS), self.share, self.median,
            max(self.times, default=None), self.walker.paper, self.way,
        )  # fmt: skip


def rough(options: Options) -> SuiteResult:
    """One attempt of every robot with every walk, in closed and open loop."""
    walkers = walkers_of(options)
    kinds = [(walker, closed) for walker in walkers for closed in options.loops]
    specs = [
        CrossingSpec(
            walker, closed, robot_seed=seed,
            **{**options.trial, "parameters": parameters_of(walker, options, closed)},
        )
        for walker, closed in kinds
        for seed in options.seeds
    ]  # fmt: skip
    results = parallel_map(
        cross, specs, jobs=options.jobs, label="crossings", show=options.show, note=_note
    )
    found = [
        Crossings(walker, closed, results[index * options.robots : (index + 1) * options.robots])
        for index, (walker, closed) in enumerate(kinds)
    ]
    columns = (
        Column("walk"), Column("loop"), *map(Column, ENDS), Column("share", "%", 0),
        Column("time, s", "median"), Column("", "longest"), Column("paper", "s"),
        Column("way", "m", 2),
    )  # fmt: skip
    notes = (
        "Hexagons of 10 cm and 0 to 15 mm on 1.5 m x 1 m unless the plant says otherwise, another "
        "field for each robot. time: of the torso over 1 m, of the robots that crossed. way: mean "
        "over all robots. left: walked out sideways. The command steers to the middle, as an "
        "operator does.",
        *(f"{each.name.replace('_', ' ')}: {each.urdf}, preset {each.preset}, sole {each.sole}, "
          f"commanded {100 * each.speed:.3g} cm/s."
          for each in walkers),
    )  # fmt: skip
    return SuiteResult(
        tuple(row for each in found for row in each.rows),
        f"Uneven ground; {options.robots_title}, plant {options.plant_title}, {options.engine}",
        (Table(columns, [each.line for each in found]),), notes,
    )  # fmt: skip


def walkers_of(options: Options) -> tuple[CrossingRobot, ...]:
    """The walks that are named; the shipped ones if none is; raises NaoGaitError."""
    known = {walker.name: walker for walker in WALKERS}
    names = options.experiments or tuple(known)
    if GIVEN in names:
        task = find_task(options.tasks[0])
        if len(options.tasks) != 1 or task.axis != "x" or task.asked <= 0.0:
            given = ", ".join(options.tasks)
            raise NaoGaitError("task", given, "one forward task, e.g. forward=20")
        known[GIVEN] = CrossingRobot(GIVEN, options.urdf, "given", "own", task.asked)
    for name in names:
        if name not in known:
            raise NaoGaitError("experiment", name, f"one of {', '.join(known)}, {GIVEN}")
    return tuple(known[name] for name in names)


def parameters_of(walker: CrossingRobot, options: BenchOptions, closed: bool) -> GaitParameters:
    """Those of its preset, or the given ones; in open loop without feedback."""
    parameters = options.parameters
    if walker.name != GIVEN:
        parameters = preset_for(loaded_robot(walker.urdf), walker.preset)
    return parameters.replace(feedback=parameters.feedback and closed)


def _note(result: CrossingResult) -> str:
    return f"{result.spec.robot.name} robot {result.spec.robot_seed}: {result.end}"


SUITE = Suite(
    name="rough",
    title="Rough ground",
    summary="crossing the second paper's field of hexagonal plates",
    measure=rough,
    options=Options,
    takes=("robots", "tasks", "open_loop"),
    quick=({"robots": 2, "open_loop": "off"},),
    check=walkers_of,
)
