"""The suite `paper`: the results section of the first paper, measured on simulated robots.

The preset `paper` in closed and open loop, and the gait of the command beside it, walk at the
paper's speeds: on calibrated robots, as the paper's was, and on robots as they are drawn. Only for
the NAO: the preset is made for it.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from gait_lab.bench.figures import paper_figures
from gait_lab.bench.options import Option, Options
from gait_lab.bench.published import PAPER_COM_ERROR
from gait_lab.bench.pushes import push_variants
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite
from gait_lab.bench.suites.peers import is_nao
from gait_lab.bench.walks import METRICS, RULES, Score, Variant, walk_all
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from robot_core.robot import NAO, load_robot
from sim_bridge.trials.tasks import Task, find_task

NAMES = {"forward=10": "slow", "forward=20": "medium"}
"""Names of the slower walks; the others are named after their direction."""
ERRORS = {"spot": ("spot", "spot"), "slow": ("slow", "forward_10"), "forward": ("full", "forward")}
"""Task -> its name among the CoM errors, and in `PAPER_COM_ERROR`."""
PUSHES = (("left", 1.0), ("right", 1.0), ("forward", 2.0), ("back", 1.75))
"""Directions and impulses [N s] of the pushes on the spot."""
GAITS = {
    "paper": Variant(preset="paper"),
    "paper_open_loop": Variant(preset="paper", parameters={"feedback": False}),
    "default": Variant(),
}


def tasks_of(options: Options) -> list[Task]:
    """The walks over their window, each at most once."""
    if not is_nao(options):
        raise NaoGaitError("robot", load_robot(options.urdf).name, f"{NAO} for this suite")
    tasks = [replace(find_task(text), name=NAMES.get(text, find_task(text).name))
             for text in options.tasks]  # fmt: skip
    names = [task.name for task in tasks]
    if len(set(names)) < len(names):
        raise NaoGaitError("task", ", ".join(options.tasks), "each direction at most once")
    return [task.lasting(options.window) for task in tasks]


def score_rows(base: str, score: Score) -> Iterator[Row]:
    """The measurements of one walk: `paper_forward_median`, `paper_com_error_spot`, ..."""
    yield from score.rows(
        "upright", "counts", "worst", "worst_of_upright", "median", "median_of_upright",
        "speed_error", *(() if score.task.axis else ("drift_worst",)), "slip_worst",
        subject=base, published=True,
    )  # fmt: skip
    if score.task.name in ERRORS:
        name, published = ERRORS[score.task.name]
        for quantity, metric in (("com_error", "com_y_error_measured_mean"),
                                 ("com_error_true", "com_y_error_mean")):  # fmt: skip
            value, paper = METRICS[metric].of(score), PAPER_COM_ERROR[published]
            yield Row(base, f"{quantity}_{name}", "mm", value, paper)


@suite(
    "paper", "The results of the first paper", "speeds, CoM errors and pushes beside the paper's",
    options={
        "robots": 20, "window": ..., "phases": 4, "open_loop": ...,
        "tasks": (
            "spot", "forward=10", "forward=20", "forward=31.5", "back=23", "side=12.5", "turn=98",
        ),
        "drawn": Option(
            "beside", "robots as drawn beside calibrated ones, off, or only", "MODE",
            ("--as-drawn",), choices=("beside", "off", "only"),
        ),
        "push": Option(True, "without pushes", "", ("--no-push",)),
        "out": Option(None, "write the paper's figures 4, 6 and 7 as PNG to this folder", "DIR",
                      parse=Path, writes="folder"),
    },
    quick=({"robots": 2, "window": 4.0, "phases": 2},), check=tasks_of, applies=is_nao,
)  # fmt: skip
def paper(options: Options) -> Iterator[Row | str]:
    """Walk and push the same robots with every gait."""
    tasks = tasks_of(options)
    gaits = {name: each for name, each in GAITS.items()
             if name != "paper_open_loop" or options.open_loop != "off"}  # fmt: skip
    conditions = {"": options.but(calibrated=True), "drawn": options}
    for condition in {"beside": ("", "drawn"), "off": ("",), "only": ("drawn",)}[options.drawn]:
        robots = conditions[condition].but(open_loop="off")
        found = walk_all(robots, tasks, list(gaits.values()))
        pushes = push_variants(robots, list(gaits.values()), PUSHES if options.push else ())
        for name, scores, pushed in zip(gaits, found, pushes, strict=True):
            base = "_".join(filter(None, (name, condition)))
            for score in scores:
                yield from score_rows(base, score)
                pushed.detection.add(*score.metrics)
            yield from pushed.survival_rows(base)
            yield from pushed.detection.rows(base)
    yield (
        "CoM error: mean over the robots of the mean |expected - measured| y as in the paper; "
        "true: |expected - true|. Without 'drawn' the robots have calibrated their soles and IMU. "
        f"{RULES}"
    )
    if options.out is not None:
        robots = conditions["drawn" if options.drawn == "only" else ""]
        written = paper_figures(robots.but(parameters=load_preset("paper")), options.out)
        yield f"Figures: {', '.join(map(str, written))}."
