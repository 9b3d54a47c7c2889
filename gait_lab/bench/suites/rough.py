"""The suite `rough`: who crosses the second paper's field of hexagonal plates, and how fast.

Each robot walks a field of its own. Bruno's two ways through it as published, beside the walks as
they are on level ground. Open loop means that no sensor changes the walk, eq. (7) included.
"""

import statistics

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, loop_name, number, table
from gait_lab.trials.crossing import CrossingResult, CrossingRobot, CrossingSpec, cross
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.tasks import find_task
from gait_lab.trials.trial import loaded_robot
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.presets import preset_for

SUITE = "rough"
PAPER_SLOW, PAPER_FAST = 45.0, 7.5
"""[s] published, over 1 m; how often it succeeded is not."""
WALKERS = (
    # sequences of 8 short steps with a pause after each; low and fast
    CrossingRobot("bruno_slow", "bruno", "rough_slow", "spring", 0.0714, 5.6, 1.5, PAPER_SLOW),
    CrossingRobot("bruno_fast", "bruno", "rough_fast", "sponge", 0.20, paper=PAPER_FAST),
    CrossingRobot("bruno_level", "bruno", "bruno", "own", 0.24),
    CrossingRobot("nao_level", "nao_h21_v33", "default", "own", 0.20),
)
"""`level`: the walk of the level floor."""
GIVEN = "given"
"""The walk of the command line, at the speed of its task, on the robot's own soles."""
TASKS = ("forward=20",)
ENDS = ("crossed", "fell", "left", "late")


def rough(options: BenchOptions) -> Report:
    """One attempt of every robot with every walk, in closed and open loop."""
    walkers = walkers_of(options)
    kinds = [(walker, closed) for walker in walkers for closed in options.loops]
    specs = [
        CrossingSpec(
            walker, closed, parameters=parameters_of(walker, options, closed), robot_seed=seed,
            plant=options.plant, plant_options=options.plant_options, engine=options.engine,
        )
        for walker, closed in kinds
        for seed in options.seeds
    ]  # fmt: skip
    results: list[CrossingResult] = parallel_map(
        cross, specs, jobs=options.jobs, label="crossings", show=options.show, note=_note
    )
    lines: list[tuple[str, ...]] = [
        ("walk", "loop", "crossed", "fell", "left", "late", "share", "time, s", "", "paper", "way"),
        ("", "", "", "", "", "", "%", "median", "longest", "s", "m"),
    ]
    rows: list[Row] = []
    for walker, closed in kinds:
        mine = [each for each in results if (each.spec.robot, each.spec.closed_loop)
                == (walker, closed)]  # fmt: skip
        rows += _rows(walker, closed, mine)
        lines.append(_line(walker, closed, mine))
    last = options.seed + options.robots - 1
    title = (
        f"Uneven ground; robots {options.seed}-{last}, plant {options.plant_title}, "
        f"{options.engine}"
    )
    notes = (
        "hexagons of 10 cm and 0 to 15 mm on 1.5 m x 1 m unless the plant says otherwise, another",
        "field for each robot. time: of the torso over 1 m, of those that crossed. way: mean over",
        "all robots. left: walked out sideways. The command steers to the middle, as people do.",
        *(f"{w.name}: {w.urdf}, preset {w.preset}, sole {w.sole}, asked {100 * w.speed:.3g} cm/s."
          for w in walkers),
    )  # fmt: skip
    return Report(tuple(rows), "\n".join((title, "", table(lines), "", *notes)))


def walkers_of(options: BenchOptions) -> tuple[CrossingRobot, ...]:
    """The walkers that are asked for; the shipped ones if none is."""
    known = {walker.name: walker for walker in WALKERS}
    names = options.experiments or tuple(known)
    if GIVEN in names:
        task = find_task(options.tasks[0])
        if len(options.tasks) != 1 or task.axis != "x" or task.asked <= 0.0:
            raise NaoGaitError("task", ", ".join(options.tasks), "one forward task, as forward=20")
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


def _rows(walker: CrossingRobot, closed: bool, results: list[CrossingResult]) -> list[Row]:
    name = walker.name if closed else f"{walker.name}_open_loop"
    times = _times(results)
    ends = [result.end for result in results]
    return [
        Row(SUITE, f"{name}_runs", "runs", len(results)),
        *(Row(SUITE, f"{name}_{end}", "runs", ends.count(end)) for end in ENDS),
        Row(SUITE, f"{name}_crossed_share", "%", _share(results)),
        Row(SUITE, f"{name}_time_median", "s", statistics.median(times) if times else None,
            walker.paper),
        Row(SUITE, f"{name}_time_worst", "s", max(times, default=None)),
        Row(SUITE, f"{name}_way_mean", "m", statistics.fmean(each.way for each in results)),
    ]  # fmt: skip


def _line(walker: CrossingRobot, closed: bool, results: list[CrossingResult]) -> tuple[str, ...]:
    times = _times(results)
    ends = [result.end for result in results]
    return (
        walker.name.replace("_", " "),
        loop_name(closed),
        *(f"{ends.count(end)}" for end in ENDS),
        number(_share(results), 0),
        number(statistics.median(times) if times else None),
        number(max(times, default=None)),
        number(walker.paper),
        number(statistics.fmean(each.way for each in results), 2),
    )


def _times(results: list[CrossingResult]) -> list[float]:
    return [result.seconds for result in results if result.seconds is not None]


def _share(results: list[CrossingResult]) -> float:
    return 100.0 * sum(result.end == "crossed" for result in results) / len(results)


def _note(result: CrossingResult) -> str:
    return f"{result.spec.robot.name} robot {result.spec.robot_seed}: {result.end}"
