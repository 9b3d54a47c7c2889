"""Suites that are data: variants of gait and plant x tasks x robots, from `config/bench/*.yaml`.

A file declares options, metrics and variants; pushes on the spot and trials in other suites may
come on top. The keys are the fields of `Sweep`.
"""

import math
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs

from gait_lab.bench import suites as package
from gait_lab.bench.options import Option, Options, declared
from gait_lab.bench.pushes import DIRECTIONS, push_variants
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import Suite
from gait_lab.bench.walks import (
    METRICS,
    RULES,
    Score,
    Variant,
    loop_detection,
    tasks_of,
    walk_all,
)
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import NAO, load_robot
from robot_core.schema import Anything, Group, Settings, Table
from sim_bridge.plant import PlantOption
from sim_bridge.trials.tasks import find_task

HALF_WINDOW = 10.0
"""[s] longest measured window at half speed."""
FACTORS = {"deg": math.radians(1.0), "mm": 1e-3, "ms": 1e-3}
"""Factor from a unit of `Level.values` to the one of the plant's option."""
FindSuite = Callable[[str], Suite]
"""Gives the suite of a name; NaoGaitError if there is none."""
_WITHOUT = "without_"
_METRICS = schema.Sequence(schema.Choice(tuple(METRICS)))


@attrs.frozen
class Change(Settings):
    """What differs in one variant of a sweep."""

    preset: str | None = schema.field(schema.Text(), None, "None = that of the bench.")
    set: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))
    plant: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))
    urdf_effort: bool = schema.field(schema.Switch(), False)
    trials: tuple[str, ...] = schema.field(schema.Sequence(schema.NAME), (), "Empty = the walks.")

    @property
    def variant(self) -> Variant:
        """What is walked."""
        return Variant(self.preset, self.set, plant_options(self.plant), self.urdf_effort)


@attrs.frozen
class Level(Settings):
    """One option of the plant and its values, the hardest to walk with last."""

    option: str = schema.field(schema.Text())
    values: tuple[Any, ...] = schema.field(schema.Sequence(Anything(), 1))
    unit: str = schema.field(schema.Text(empty=True), "")
    along: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))

    def variants(self, name: str) -> dict[str, Variant]:
        """A variant per value."""
        found = {}
        for value in self.values:
            held = value if isinstance(value, bool) else value * FACTORS.get(self.unit, 1.0)
            change = (*plant_options(self.along), (self.option, held))
            found[f"{name}_{_text(value)}"] = Variant(plant=change)
        return found


@attrs.frozen
class Trial(Settings):
    """A run of another suite, of which some metrics are compared with and without a change."""

    suite: str = schema.field(schema.NAME)
    metrics: tuple[str, ...] = schema.field(schema.Sequence(schema.Text(), 1))
    options: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))

    def values(
        self, suite: Suite, options: Options, parameters: GaitParameters
    ) -> dict[str, Row]:
        """The rows of a run of its suite with these parameters, by metric."""
        usual = {name: options.values[name] for name in suite.options if name in _INHERITED}
        given = {**usual, **plain(self.options), "show": options.show}
        of_suite = Options.of(suite.options, given).but(parameters=parameters)
        suite.check(of_suite)
        plant = of_suite.plant_title
        rows = suite.run(of_suite).rows
        return {row.metric: row._replace(plant=row.plant or plant) for row in rows}


_INHERITED = ("robots", "seed", "engine", "plant", "plant_options", "urdf", "jobs")
"""Options of a sweep that its trials take over."""


@attrs.frozen(kw_only=True)
class Sweep(Settings):
    """A suite of walks, as a file declares it."""

    title: str = schema.field(schema.Text())
    summary: str = schema.field(schema.Text())
    note: str = schema.field(schema.Text(empty=True), "", "For the reader of the tables.")
    options: dict[str, Any] = schema.field(
        Table(Anything()), attrs.Factory(dict), "Shared options and their defaults, null = usual."
    )
    quick: tuple[dict[str, Any], ...] = schema.field(schema.Sequence(Table(Anything())), ({},))
    engines: tuple[str, ...] = schema.field(schema.Sequence(schema.Text()), ())
    labelled: bool = schema.field(schema.Switch(), False, "Speeds are part of the tasks' names.")
    closed_only: bool = schema.field(schema.Switch(), False, "Never in open loop.")
    published: bool = schema.field(schema.Switch(), False, "The paper's values beside a NAO's.")
    metrics: tuple[str, ...] = schema.field(_METRICS)
    at_rest: tuple[str, ...] = schema.field(_METRICS, (), "Also for tasks without a speed.")
    half: tuple[str, ...] = schema.field(_METRICS, (), "Also at half of each speed.")
    always: tuple[str, ...] = schema.field(schema.Sequence(schema.Text()), (), "More tasks.")
    variants: dict[str, Change] = schema.field(
        Table(Group(Change), key=schema.NAME), attrs.Factory(dict)
    )
    levels: dict[str, Level] = schema.field(
        Table(Group(Level), key=schema.NAME), attrs.Factory(dict)
    )
    pushes: dict[str, float] = schema.field(
        Table(schema.Number(0.0, 100.0, "N s"), key=schema.Choice(tuple(DIRECTIONS))),
        attrs.Factory(dict), "On the spot: an impulse [N s] for each direction.",
    )  # fmt: skip
    trials: dict[str, Trial] = schema.field(
        Table(Group(Trial), key=schema.NAME), attrs.Factory(dict)
    )

    def declared(self) -> dict[str, Option]:
        """Its options."""
        found = {name: ... if value is None else value
                 for name, value in plain(self.options).items()}  # fmt: skip
        if self.half:
            found["half_speed"] = Option(True, "not also at half of each speed", "", ("--no-half",))
        if self.variants:
            names = tuple(self.variants)
            found["only"] = Option(names, "only this variant", "NAME", choices=names)
            found["changes"] = Option(
                None, "YAML file of other variants, as in config/bench/", "FILE", parse=Path
            )
        if self.levels:
            names = tuple(self.levels)
            found["ingredients"] = Option(
                names, "vary only this", "NAME", ("--ingredient",), choices=names
            )
        return declared(found)

    def check(self, options: Options) -> None:
        """Raise NaoGaitError for what cannot be run."""
        if self.engines and options.engine not in self.engines:
            raise NaoGaitError("engine", options.engine, f"{' or '.join(self.engines)} here")
        tasks_of(options, self.labelled)
        self.chosen(options)

    def chosen(self, options: Options) -> dict[str, Change]:
        """The variants of the options; NaoGaitError for a bad file."""
        if options.values.get("changes") is not None:
            return load_changes(options.changes, self.trials)
        return {name: self.variants[name] for name in options.values.get("only", ())}

    def measure(self, options: Options, more: Mapping[str, Variant] = {}) -> Iterator[Row | str]:
        """Walk and push every variant on the same robots.

        Args:
            options: Robots, tasks, engine, plant, parameters.
            more: Variants besides those of the file.
        """
        changes = self.chosen(options)
        if self.levels:
            changes = {"unchanged": Change()}
        walked = {name: each.variant for name, each in changes.items() if not each.trials}
        walked |= more
        for name in options.values.get("ingredients", ()):
            walked |= self.levels[name].variants(name)
        if not self.variants and not self.levels:
            walked = {"": Variant()}
        yield from self._walks(options, walked)
        yield f"{self.note} {RULES}".strip()

    def _walks(self, options: Options, variants: Mapping[str, Variant]) -> Iterator[Row]:
        tasks = tasks_of(options, self.labelled)
        tasks += [find_task(name).lasting(options.window) for name in self.always]
        halves = [task.scaled(0.5, f"{task.name}_half").lasting(min(options.window, HALF_WINDOW))
                  for task in tasks
                  if self.half and task.axis and options.half_speed]  # fmt: skip
        if self.closed_only:
            options = options.but(open_loop="off")
        every = list(variants.values())
        found = dict(
            zip(variants, walk_all(options, [*tasks, *halves], every), strict=True)
        )
        pushed = dict(
            zip(variants, push_variants(options, every, list(self.pushes.items())), strict=True)
        )
        published = self.published and load_robot(options.urdf).name == NAO
        halved = {task.name for task in halves}
        for name, scores in found.items():
            for score in scores:
                metrics = self.half if score.task.name in halved else self.metrics
                if score.task.axis is None and self.at_rest:
                    metrics = self.at_rest
                rows = score.rows(*metrics, subject=name, published=published)
                title = variants[name].plant_title(options)
                yield from (row._replace(plant=title) for row in rows)
            yield from pushed[name].survival_rows(name)
            if self.closed_only and variants[name].walker is None:  # others detect no falls
                detection = pushed[name].detection
                for score in scores:
                    detection.add(*score.metrics)
                yield from detection.rows(name)
        yield from self._breaks(options, found)
        if not self.closed_only:
            yield from loop_detection(score for scores in found.values() for score in scores)

    def _breaks(self, options: Options, found: Mapping[str, list[Score]]) -> Iterator[Row]:
        """The first value of each level that fells a robot."""
        for name in options.values.get("ingredients", ()):
            level = self.levels[name]
            for index, unchanged in enumerate(found["unchanged"]):
                broken = (float(value) for value in level.values
                          if len(found[f"{name}_{_text(value)}"][index].upright)
                          < options.robots)  # fmt: skip
                value = next(broken, None)
                yield Row(f"{name}_{unchanged.name}", "breaks_at", level.unit, value)

    def measure_trials(self, options: Options, find: FindSuite) -> Iterator[Row]:
        """The metrics of each trial with an extension and without it."""
        changes = self.chosen(options)
        before: dict[tuple[str, str | None], dict[str, Row]] = {}
        for name, change in changes.items():
            base = options.parameters if change.preset is None else load_preset(change.preset)
            for trial in change.trials:
                asked, key = self.trials[trial], (trial, change.preset)
                suite = find(asked.suite)
                if key not in before:
                    before[key] = asked.values(suite, options, base)
                after = asked.values(suite, options, base.replace(**change.set))
                for metric in asked.metrics:
                    if metric not in after:
                        raise NaoGaitError(
                            f"trial {trial}", metric, f"a metric of it: {', '.join(after)}"
                        )
                    subject = f"{name.removeprefix(_WITHOUT)}_{metric}"
                    for quantity, rows in (("with", before[key]), ("without", after)):
                        row = rows[metric]
                        yield Row(subject, quantity, row.unit, row.value, None, row.plant)


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Options as they stand in YAML, in their own types: tuples, and options of the plant."""
    return {
        name: tuple(value) if isinstance(value, list) else plant_options(value)
        if isinstance(value, Mapping) else value
        for name, value in values.items()
    }  # fmt: skip


def plant_options(values: Mapping[str, Any]) -> tuple[PlantOption, ...]:
    """Options of the plant from a mapping."""
    return tuple((name, tuple(each) if isinstance(each, list) else each)
                 for name, each in values.items())  # fmt: skip


def load_changes(path: Path, trials: Iterable[str] = ()) -> dict[str, Change]:
    """The variants of a file of their own; NaoGaitError for a bad one."""
    entries = schema.read_yaml(path, "changes")
    where, kind = f"changes {path}", Table(Group(Change), 1, schema.NAME)
    found: dict[str, Change] = kind.check(where, entries)
    _check_changes(found, tuple(trials), where)
    return found


def load_sweep(path: Path) -> Sweep:
    """The sweep of a file; NaoGaitError for a bad one."""
    where = f"sweep {path}"
    sweep = Sweep.from_mapping(schema.read_yaml(path, "sweep"), where)
    _check_changes(sweep.variants, tuple(sweep.trials), where)
    return sweep


def _check_changes(changes: Mapping[str, Change], trials: tuple[str, ...], where: str) -> None:
    for name, change in changes.items():
        GaitParameters.checked(change.set, f"{where}: {name}.set", partial=True)
        change.variant.of(GaitParameters())  # an unknown preset
        for each in change.trials:
            schema.Choice(trials).check(f"{where}: {name}.trials", each)
        if change.trials and not name.startswith(_WITHOUT):
            allowed = f"{_WITHOUT}NAME for a change with trials, any name for one without trials"
            raise NaoGaitError(f"{where}: {name}", name, allowed)


def sweep_suite(name: str, sweep: Sweep, find: FindSuite | None = None) -> Suite:
    """The suite of a sweep; with `find`, its trials are run, too."""

    def measure(options: Options) -> Iterator[Row | str]:
        yield from sweep.measure(options)
        if find is not None:
            yield from sweep.measure_trials(options, find)

    return Suite(
        name, sweep.title, sweep.summary, measure, sweep.declared(),
        tuple(plain(each) for each in sweep.quick), sweep.check,
        lambda options: not sweep.engines or options.engine in sweep.engines,
    )  # fmt: skip


def shipped_sweeps(find: FindSuite) -> Iterator[Suite]:
    """The suites of `config/bench` but for those that a module completes; `find`: for trials."""
    modules = {each.name for each in pkgutil.iter_modules(package.__path__)}
    for path in sorted(share("config", "bench").glob("*.yaml")):
        if path.stem not in modules:
            yield sweep_suite(path.stem, load_sweep(path), find)


def _text(value: float | bool) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if abs(value) < 1e5 else f"{value:.0f}"
