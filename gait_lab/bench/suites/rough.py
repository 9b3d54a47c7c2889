"""The suite `rough`: which walks cross the second paper's field of hexagonal plates, and how fast.

Each robot walks on a field of its own. Bruno's two published walks, beside the walks for level
ground as they are. Open loop means that no sensor changes the walk, eq. (7) included.
"""

import statistics
from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median, worst
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.presets import preset_for
from robot_core.errors import NaoGaitError
from sim_bridge.trials.crossing import CrossingResult, CrossingRobot, CrossingSpec, cross
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


def walkers_of(options: Options) -> tuple[CrossingRobot, ...]:
    """The walks that are named; raises NaoGaitError."""
    known = {walker.name: walker for walker in WALKERS}
    if GIVEN in options.experiments:
        task = find_task(options.tasks[0])
        if len(options.tasks) != 1 or task.axis != "x" or task.asked <= 0.0:
            given = ", ".join(options.tasks)
            raise NaoGaitError("task", given, "one forward task, e.g. forward=20")
        known[GIVEN] = CrossingRobot(GIVEN, options.urdf, "given", "own", task.asked)
    return tuple(known[name] for name in options.experiments)


def parameters_of(walker: CrossingRobot, options: Options, closed: bool) -> GaitParameters:
    """Those of its preset, or the given ones; in open loop without feedback."""
    parameters = options.parameters
    if walker.name != GIVEN:
        parameters = preset_for(loaded_robot(walker.urdf), walker.preset)
    return parameters.replace(feedback=parameters.feedback and closed)


@suite(
    "rough", "Rough ground", "crossing the second paper's field of hexagonal plates",
    options={
        "robots": 20, "tasks": ("forward=20",), "open_loop": ...,
        "experiments": Option(
            tuple(walker.name for walker in WALKERS),
            "only this walk; given: by --robot, --preset, --set, --task", "NAME",
            ("--experiment",), choices=(*(walker.name for walker in WALKERS), GIVEN),
        ),
    },
    quick=({"robots": 2, "open_loop": "off"},), check=walkers_of,
)  # fmt: skip
def rough(options: Options) -> Iterator[Row | str]:
    """One attempt of every robot with every walk, in closed and open loop."""
    kinds = [(walker, closed) for walker in walkers_of(options) for closed in options.loops]
    specs = [
        CrossingSpec(
            walker, robot_seed=seed,
            **{**options.trial, "parameters": parameters_of(walker, options, closed)},
        )
        for walker, closed in kinds for seed in options.seeds
    ]  # fmt: skip
    results: list[CrossingResult] = options.map(
        cross, specs, label="crossings",
        note=lambda each: f"{each.spec.robot.name} robot {each.spec.robot_seed}: {each.end}",
    )  # fmt: skip
    for (walker, closed), mine in zip(kinds, options.by_robots(results), strict=True):
        name = walker.name if closed else f"{walker.name}_open_loop"
        times = [each.seconds for each in mine if each.seconds is not None]
        yield Row(name, "runs", "runs", len(mine))
        for end in ENDS:
            yield Row(name, end, "runs", sum(each.end == end for each in mine))
        share = sum(each.end == "crossed" for each in mine) / len(mine)
        yield Row(name, "crossed_share", "%", 100.0 * share)
        yield Row(name, "time_median", "s", median(times), walker.paper)
        yield Row(name, "time_worst", "s", worst(times))
        yield Row(name, "way_mean", "m", statistics.fmean(each.way for each in mine))
    yield (
        "Hexagons of 10 cm and 0 to 15 mm on 1.5 m x 1 m unless the plant says otherwise, another "
        "field for each robot. time: of the torso over 1 m, of the robots that crossed. left: "
        "walked out sideways. The command steers to the middle, as an operator does."
    )
