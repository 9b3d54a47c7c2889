"""The suites of faults: `faults`, `fuzz`, `loss` and `soak`."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median, tasks_of
from gait_lab.faults.campaign import FELL, VIOLATED, FaultResult, FaultRun
from gait_lab.faults.long_walks import LossWalk, soak, walk_with_loss
from gait_lab.faults.scopes import SCOPES, Scope
from nao_lipm_gait.presets import DEFAULT, preset_for
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.trials.progress import Progress

_EVIDENCE = 20
"""Violations that are listed one by one."""
WARM_UP = 0.2
"""Share of the time of a soak in which caches fill."""
STRETCH = 10_000
"""Ticks of the fuzz with one seed."""


def fault_run(options: Options, fault: str, seed: int) -> FaultRun:
    """One run on the robot, plant and engine of the options."""
    return FaultRun(fault, seed, **options.trial)


# -- faults ----------------------------------------------------------------------------------------


def classes_of(scope: Scope, names: Sequence[str]) -> tuple[str, ...]:
    """The classes of these names, all if none is named; raises NaoGaitError."""
    for name in names:
        if name not in scope.all_classes:
            raise NaoGaitError("fault", name, scope.all_classes)
    return tuple(dict.fromkeys(names)) or tuple(scope.classes)


def check_faults(options: Options) -> None:
    """Raise NaoGaitError for what a scope cannot do."""
    classes_of(SCOPES[options.scope], options.faults)
    usual = preset_for(load_robot(options.urdf), DEFAULT)
    if options.scope != "gait" and options.parameters != usual:
        allowed = f"those of the robot's own preset in the scope {options.scope}"
        raise NaoGaitError("preset or set", "other parameters", allowed)
    if options.scope == "robot" and options.plant_options:
        name, value = options.plant_options[0]
        raise NaoGaitError("plant-set", f"{name}={value}", "nothing in the scope robot")


@suite(
    "faults", "Faults in the middle of a walk",
    "every class of faults of sensors, messages and processes, in a walk or in a match",
    options={
        "scope": Option(
            "gait", "what fails: sensors, messages and processes of a walk (gait), cameras, "
            "percepts, mate and referee of a player (soccer), ROS 2 nodes of a robot (robot)",
            "SCOPE", choices=tuple(SCOPES),
        ),
        "runs": Option(
            0, "runs in all, shared among the classes; 0 = the usual number of the scope: "
            + ", ".join(f"{each.usual} of {name}" for name, each in SCOPES.items()), "N",
            minimum=0, maximum=10_000_000,
        ),
        "faults": Option((), "only this class, e.g. imu_outage", "NAME", ("--fault",)),
        "resume": ...,
    },
    quick=({"runs": 56},), check=check_faults, same_robots=False,
)  # fmt: skip
def faults(options: Options) -> Iterator[Row | str]:
    """The campaign: outcomes per class, why robots fell, and the evidence of every violation."""
    scope = SCOPES[options.scope]
    names, first = classes_of(scope, options.faults), max(options.seed, 0)
    runs = [fault_run(options, names[index % len(names)], first + index // len(names))
            for index in range(options.runs or scope.usual)]  # fmt: skip
    verdicts: list[FaultResult] = options.map(
        scope.run, runs, label="faults",
        note=lambda verdict: f"{verdict.run.fault}: {verdict.outcome}",
        restore=FaultResult,
    )  # fmt: skip
    by_class: dict[str, list[FaultResult]] = {}
    for verdict in verdicts:
        by_class.setdefault(verdict.run.fault, []).append(verdict)
    for name, found in {**by_class, "all": verdicts}.items():
        count = Counter(verdict.outcome for verdict in found)
        yield from (Row(name, outcome, "runs", count[outcome]) for outcome in scope.outcomes)
    yield from scope.notes
    for name, found in by_class.items():
        why = scope.all_classes[name].why
        if why and any(verdict.outcome == FELL for verdict in found):
            yield f"Falls, {name.replace('_', ' ')}: {why}"
    broken = [verdict for verdict in verdicts if verdict.outcome == VIOLATED]
    for verdict in broken[:_EVIDENCE]:
        evidence = "; ".join(verdict.violations)
        yield f"VIOLATED {verdict.run.fault}, seed {verdict.run.seed}: {evidence}"


# -- fuzz ------------------------------------------------------------------------------------------


@suite(
    "fuzz", "Malformed messages and broken files",
    "malformed messages into every input, broken files into every loader",
    options={
        "ticks": Option(1_000_000, "ticks of the gait", "N", minimum=1, maximum=10**12),
        "resume": ...,
    },
    gait=False, quick=({"ticks": 20_000},), same_robots=False,
)  # fmt: skip
def fuzz(options: Options) -> Iterator[Row | str]:
    """All ticks in stretches, each with a seed of its own."""
    # Here: Hypothesis and the readers of bags take half of the start of `nao_gait bench`.
    from gait_lab.faults.fuzz import FILES, GAIT, LOLA, TARGETS, TICKS, FuzzResult, FuzzRun
    from gait_lab.faults.fuzz import fuzz as run_fuzz

    count, rest = divmod(options.ticks, STRETCH)
    lengths = [STRETCH] * count + ([rest] if rest else [])
    ticks, passed, refused = Counter[str](), Counter[str](), Counter[str]()
    broken: list[str] = []
    for target in TARGETS:
        share = TICKS if target == FILES else 1
        runs = [FuzzRun(target, options.seed + index, max(1, length // share))
                for index, length in enumerate(lengths)]  # fmt: skip
        for one in options.map(
            run_fuzz, runs, label=target, restore=FuzzResult,
            note=lambda one: f"{len(one.violations)} violations",
        ):  # fmt: skip
            ticks[target] += one.run.ticks
            passed[target] += one.passed
            refused[target] += one.refused
            broken += [f"{target}, seed {one.run.seed}: {text}" for text in one.violations]
    yield from rows_of(
        "",
        ("ticks", "ticks", ticks[GAIT]),
        ("answers", "commands", passed[GAIT]),
        ("refused", "messages", refused[GAIT]),
        ("lola_messages", "messages", ticks[LOLA]),
        ("lola_refused", "messages", refused[LOLA]),
        ("files", "files", passed[FILES] + refused[FILES]),
        ("files_refused", "files", refused[FILES]),
        ("violations", "", len(broken)),
    )
    yield from (f"VIOLATED {each}" for each in broken[:_EVIDENCE])


# -- loss ------------------------------------------------------------------------------------------


def check_loss(options: Options) -> None:
    """Raise NaoGaitError for a task that is not straight ahead."""
    for task in tasks_of(options):
        if task.command.y != 0.0 or task.command.yaw != 0.0 or task.command.x <= 0.0:
            raise NaoGaitError("task", task.name, "forward walks for suite loss, e.g. forward=20")


@suite(
    "loss", "Lost messages", "a long walk during which a share of all messages is lost",
    options={
        "robots": 20, "window": 60.0, "tasks": ("forward=20",),
        "loss": Option(10.0, "share of all messages that are lost, in %", "P", minimum=0.0,
                       maximum=100.0),
        "wander": Option(0.0, "the age of the sensors wanders by up to this, in ms", "MS",
                         minimum=0.0, maximum=200.0),
        "coast": Option(True, "the gait does not walk on without sensors", "", ("--no-coast",)),
    },
    quick=({"robots": 2, "window": 10.0},), check=check_loss,
)  # fmt: skip
def loss(options: Options) -> Iterator[Row | str]:
    """Messages are lost in both directions, or late; every robot walks for the window."""
    share, wander = options.loss / 100.0, options.wander / 1000.0
    for task in tasks_of(options):
        walks = [
            LossWalk(fault_run(options, "loss", seed), share, task.command.x, options.window,
                     wander, options.coast)
            for seed in options.seeds
        ]  # fmt: skip
        found = options.map(
            walk_with_loss, walks, label=task.name,
            note=lambda one: f"robot {one.walk.run.seed}: "
            + ("upright" if one.fell_at is None else f"fell at {one.fell_at:.1f} s"),
        )  # fmt: skip
        speeds = [100.0 * each.speed for each in found if math.isfinite(each.speed)]
        late = f"_wander_{options.wander:g}" if options.wander > 0.0 else ""
        yield from rows_of(
            f"{task.name}_{options.loss:g}{late}",
            ("upright", "robots", sum(each.fell_at is None for each in found)),
            ("violations", "robots", sum(bool(each.violations) for each in found)),
            ("worst", "cm/s", min(speeds, default=None)),
            ("median", "cm/s", median(speeds)),
        )
        for each in found:
            if each.violations:
                yield f"VIOLATED robot {each.walk.run.seed}: {'; '.join(each.violations)}"
    coasts = " and walks on while they are missing (`coast`)" if options.coast else ""
    yield (
        "Sensor messages, velocity commands and joint commands. Speeds of the robots that stayed "
        "upright; flight and slip are not checked. The gait measures the age of its sensors "
        f"(`sensor_age`){coasts}: off by default in the node."
    )


# -- soak ------------------------------------------------------------------------------------------


@suite(
    "soak", "Memory over a long walk",
    "growth of one process over minutes or hours of simulated walking",
    options={"minutes": Option(30.0, "simulated minutes in one process", "M", minimum=0.05,
                               maximum=1e5)},
    quick=({"minutes": 1.0},),
)  # fmt: skip
def soak_suite(options: Options) -> Iterator[Row | str]:
    """Memory and objects at the beginning and at the end of a walk of random commands."""
    samples = []
    run, interval = fault_run(options, "none", options.seed), min(10.0, 6.0 * options.minutes)
    with Progress(total=options.minutes * 60.0, unit="s", show=options.show) as bar:
        for sample in soak(run, options.minutes, interval):
            samples.append(sample)
            bar.update(sample.seconds - bar.n)
    kept = samples[int(WARM_UP * len(samples)) :]
    first, last, memory = kept[0], kept[-1], [each.memory for each in kept]
    yield from rows_of(
        "",
        ("minutes", "min", options.minutes),
        ("memory", "MB", last.memory / 1e6),
        ("memory_growth", "%", 100.0 * (last.memory / first.memory - 1.0)),
        ("memory_spread", "%", 100.0 * (max(memory) / min(memory) - 1.0)),
        ("object_growth", "%", 100.0 * (last.objects / first.objects - 1.0)),
        ("falls", "falls", last.falls),
        ("steps", "steps", last.steps),
        ("violations", "kinds", len(last.violations)),
    )
    yield from (f"VIOLATED {text}" for text in last.violations)
