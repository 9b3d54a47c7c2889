"""`nao_gait results`: docs/results.csv, measured section by section, and docs/results.md from it.

A section is one run of a suite, declared in `config/results.yaml`. The CSV holds the rows of all
sections; before them stands a comment line for each with commit, command and the fingerprints of
the walks that the figures depend on. A finished section of the same commit, command and
fingerprints is not run again, and a campaign keeps its finished runs in `KEPT`, so an interrupted
run continues where it stopped.
"""

import csv
import hashlib
import io
import json
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import attrs

import gait_lab
from gait_lab.bench import published
from gait_lab.bench.figures import push_figure
from gait_lab.bench.fingerprint import Fingerprint, fingerprints_of
from gait_lab.bench.registry import Run, find_suite, plan
from gait_lab.bench.rows import Cell, table_text
from gait_lab.bench.sweep import Sweep, load_sweep, plain
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.schema import Anything, Choice, Group, Settings, Table

ROOT = Path(gait_lab.__file__).resolve().parents[1]
CODE = (
    "config", "gait_lab", "lola_bridge", "nao_lipm_gait", "nao_soccer", "rcss_bridge", "robot_core",
    "sim_bridge", "urdf",
)  # fmt: skip
"""What the figures depend on; other files may change without making a result old."""
KEPT = ROOT / "build" / "results"
"""Finished runs of the campaigns."""
REPORTED = {"robots": 20, "seed": 40}
"""Robots 40 to 59. The parameters were chosen on robots 0 to 39."""
COLUMNS = ("section", "suite", "metric", "unit", "value", "paper", "engine", "plant", "robots",
           "seed")  # fmt: skip
PUBLISHED: Mapping[str, Mapping[str, Any]] = {
    "paper": published.PAPER_SPEED, "placo": published.PLACO_SPEED, "nao": published.NAO_SPEED,
    "paper_com_error": published.PAPER_COM_ERROR, "placo_push": published.PLACO_PUSH,
}  # fmt: skip


@attrs.frozen
class Section(Settings):
    """One run of a suite."""

    suite: str = schema.field(schema.NAME)
    full: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))
    quick: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))
    walks: tuple[str, ...] = schema.field(
        schema.Sequence(schema.Text()), ("mujoco/walk/default",), "Keys of reference rollouts."
    )

    def plan(self, quick: bool, placo_python: str | None = None, jobs: int | None = None) -> Run:
        """The run of this section; raises NaoGaitError if its input is bad."""
        options = find_suite(self.suite).options
        given: dict[str, Any] = {key: each for key, each in REPORTED.items() if key in options}
        given |= plain({**self.full, **(self.quick if quick else {})})
        given |= {"jobs": jobs} if jobs is not None else {}
        given |= {"placo_python": placo_python} if "placo_python" in options else {}
        (run,) = plan(self.suite, given)
        return run


@attrs.frozen(kw_only=True)
class PageTable(Settings):
    """A table of the page; its lines by label, or the section whose variants are the lines."""

    title: str = schema.field(schema.Text(empty=True), "")
    text: str = schema.field(schema.Text(empty=True), "")
    figure: str = schema.field(schema.Text(empty=True), "", "Section of pushes to draw.")
    lines: Any = schema.field(Anything())
    columns: dict[str, str] = schema.field(Table(schema.Text(), key=schema.Text(empty=True)))


@attrs.frozen
class Plan(Settings):
    """What is measured and shown."""

    sections: dict[str, Section] = schema.field(Table(Group(Section), key=schema.NAME))
    page: tuple[PageTable, ...] = schema.field(schema.Sequence(Group(PageTable)))


@cache
def results_plan() -> Plan:
    """The plan of `config/results.yaml`."""
    path = share("config", "results.yaml")
    return Plan.from_mapping(schema.read_yaml(path, "results"), f"results {path}")


@dataclass(frozen=True, slots=True)
class Measured:
    """A measured section.

    Attributes:
        head: Commit, changes, command, quick, stale, fingerprints, and the duration in seconds,
            `took`, unless the run resumed an interrupted one.
        rows: Rows as in JSON.
    """

    head: Mapping[str, Any]
    rows: Sequence[Mapping[str, Any]] = field(default=())

    @property
    def values(self) -> dict[str, float | None]:
        """Metric -> value."""
        return {row["metric"]: row["value"] for row in self.rows}

    @property
    def commit(self) -> str:
        """The commit, in short, and whether there were changes."""
        changed = " with uncommitted changes" if self.head["changes"] else ""
        return f"{self.head['commit'][:12]}{changed}"

    def is_current(self, walks: Iterable[str], found: Mapping[str, Fingerprint]) -> bool:
        """Whether the walks that it depends on are those of the present code."""
        stored: Mapping[str, Sequence[Any]] = self.head["fingerprints"]
        same = all(key in found and found[key].is_same_walk(each) for key, each in stored.items())
        return same and set(walks) <= set(stored)


@dataclass(frozen=True, slots=True)
class CodeState:
    """The version of the code.

    Attributes:
        commit: Last commit that changed something in `CODE`.
        changes: Hash of what is not committed in there; empty if nothing is.
    """

    commit: str
    changes: str

    @classmethod
    def of(cls, root: Path = ROOT) -> "CodeState":
        """The state of a git checkout; raises NaoGaitError if it is none."""
        commit = _git(root, "log", "-1", "--format=%H", "--", *CODE).decode().strip()
        changed = _git(root, "diff", "HEAD", "--", *CODE)
        new = _git(root, "ls-files", "-z", "--others", "--exclude-standard", "--", *CODE)
        for name in filter(None, new.decode().split("\0")):
            changed += name.encode() + (root / name).read_bytes()
        return cls(commit, hashlib.sha256(changed).hexdigest()[:12] if changed else "")


def _git(root: Path, *arguments: str) -> bytes:
    command = ["git", "-C", str(root), *arguments]
    try:
        return subprocess.run(command, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        raise NaoGaitError("results", str(root), "a git checkout with a commit") from error


@dataclass(frozen=True, slots=True)
class ResultsOptions:
    """Options of `nao_gait results`, as the command line explains them."""

    docs: Path
    only: tuple[str, ...] = ()
    quick: bool = False
    allow_dirty: bool = False
    placo_python: str | None = None
    jobs: int | None = None

    def __post_init__(self) -> None:
        for name in self.only:
            Choice(tuple(results_plan().sections)).check("only", name)

    @property
    def file(self) -> Path:
        """The CSV."""
        return self.docs / "results.csv"

    @property
    def sections(self) -> dict[str, Section]:
        """The sections to run."""
        known = results_plan().sections
        if "peers" in self.only and self.placo_python is None:
            raise NaoGaitError(
                "placo-python", "", "a Python with placo (required by the section peers)"
            )
        return {
            name: each for name, each in known.items()
            if (name in self.only or not self.only) and (self.placo_python or name != "peers")
        }  # fmt: skip


def command(
    say: Callable[[str], None], *, mark_stale: bool, only: Sequence[str], docs: Path | None,
    **more: Any,
) -> None:  # fmt: skip
    """Measure, or mark what is stale; with the fields of `ResultsOptions`."""
    options = ResultsOptions(docs or ROOT / "docs", tuple(only), **more)
    if not options.docs.is_dir():
        raise NaoGaitError("docs", str(options.docs), "a folder")
    (mark_old if mark_stale else measure)(options, say)


def measure(options: ResultsOptions, out: Callable[[str], None] = print) -> None:
    """Run the sections that are not finished, write their rows and the page.

    Raises:
        NaoGaitError: There are changes that are not committed, or the input is bad.
    """
    code = CodeState.of()
    if code.changes and not (options.quick or options.allow_dirty):
        raise NaoGaitError(
            "results", f"uncommitted changes in {', '.join(CODE)}",
            "a committed state, --quick or --allow-dirty",
        )  # fmt: skip
    sections = options.sections
    runs = {name: each.plan(options.quick, options.placo_python, options.jobs)
            for name, each in sections.items()}  # fmt: skip
    results = load(options.file) if options.file.is_file() else {}
    found = fingerprints_of({key for each in sections.values() for key in each.walks}, options.jobs)
    for number, (name, section) in enumerate(sections.items(), 1):
        run = runs[name]
        command = run.command
        if options.placo_python is not None:
            command = command.replace(options.placo_python, "placo-env/bin/python")
        head: dict[str, Any] = {
            "commit": code.commit, "changes": code.changes, "command": command,
            "quick": options.quick, "stale": False,
            "fingerprints": {key: found[key].as_list() for key in section.walks},
        }  # fmt: skip
        label, before = f"[{number}/{len(sections)}] {name}", results.get(name)
        if before is not None and before.is_current(section.walks, found) and all(
            before.head[key] == head[key] for key in ("commit", "changes", "command", "stale")
        ):
            out(f"{label}: finished before")
            continue
        out(f"{label}: {command}")
        kept = _kept_runs(name, run, head)
        resumes, began = kept is not None and kept.exists(), time.monotonic()
        result = run.suite.run(run.options if kept is None else run.options.but(resume=str(kept)))
        took = time.monotonic() - began
        if not resumes:  # else it is the time of the remaining runs alone
            head["took"] = round(took, 1)
        results[name] = Measured(head, result.as_dicts())
        save(options.file, results)
        out(f"{result.text}\n{name}: {'resumed, ' * resumes}took {took:.0f} s\n")
    write_page(options.docs)
    out(f"wrote {options.file} and results.md")


def _kept_runs(name: str, run: Run, head: Mapping[str, Any]) -> Path | None:
    """The file of a campaign's finished runs; None if it is none."""
    if "resume" not in run.suite.options:
        return None
    parts = (head["commit"], head["changes"], head["command"], head["fingerprints"])
    key = hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:12]
    KEPT.mkdir(parents=True, exist_ok=True)
    return KEPT / f"{name}-{key}.jsonl"


def load(file: Path) -> dict[str, Measured]:
    """Section -> what was measured, of a results file; raises NaoGaitError if it is none."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        heads = [json.loads(line[1:]) for line in lines if line.startswith("#")]
        rows: dict[str, list[Mapping[str, Any]]] = {each.pop("section"): [] for each in heads}
        for row in csv.DictReader(line for line in lines if not line.startswith("#")):
            numbers: dict[str, Any] = {
                name: float(row[name]) if row[name] else None for name in ("value", "paper")
            }
            numbers |= {name: int(row[name]) if row[name] else None for name in ("robots", "seed")}
            rows[row.pop("section")].append({**row, **numbers})
        for head in heads:
            head["commit"], head["command"], head["fingerprints"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise NaoGaitError("results", str(file), f"a file of nao_gait results ({error})") from error
    return {name: Measured(head, of) for head, (name, of) in zip(heads, rows.items(), strict=True)}


def save(file: Path, results: Mapping[str, Measured]) -> None:
    """Write a results file, in one step: an interrupted run leaves no partial one."""
    order = [name for name in results_plan().sections if name in results]
    text = io.StringIO()
    for name in order:
        text.write(f"# {json.dumps({'section': name, **results[name].head})}\n")
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for name in order:
        writer.writerows({"section": name, **row} for row in results[name].rows)
    schema.write_text(file, text.getvalue(), "results")


def outdated(results: Mapping[str, Measured], jobs: int | None = None) -> list[str]:
    """The sections whose walks have changed and that are not marked as stale."""
    open_ones = {name: each for name, each in results.items() if not each.head["stale"]}
    keys = {key for each in open_ones.values() for key in each.head["fingerprints"]}
    found, sections = fingerprints_of(keys, jobs), results_plan().sections
    return [
        name for name, each in open_ones.items()
        if not each.is_current(sections[name].walks if name in sections else (), found)
    ]  # fmt: skip


def mark_old(options: ResultsOptions, out: Callable[[str], None] = print) -> None:
    """Mark the sections whose walks have changed; the page says so. `only` limits them."""
    results = load(options.file)
    wanted = {name: each for name, each in results.items()
              if not options.only or name in options.only}  # fmt: skip
    marked = outdated(wanted, options.jobs)
    for name in marked:
        results[name] = Measured({**results[name].head, "stale": True}, results[name].rows)
        out(f"stale: {name}")
    save(options.file, results)
    write_page(options.docs)
    out(f"{len(wanted)} sections, {len(marked)} newly marked as stale")


# -- page ------------------------------------------------------------------------------------------

INTRODUCTION = """\
# Results

Written by `nao_gait results` from [results.csv](results.csv), which holds every measured value
({sections} sections, {rows} rows) with commit, command and, of uninterrupted runs, the seconds.
Earlier walk: measured before the walk last changed. Robots are individuals drawn from the plant
([plants.md](plants.md)): 40 to 59, while the parameters were chosen on others; engine MuJoCo. A
speed counts only without a fall, with flight of at most 5 %, slip of at most 3 cm/s and no contact
of the legs. Paper: Graf and Röfer on a real NAO. placo: its open-loop walk on a similar plant, nine
robots with stronger motors. NAO: the fastest walk measured on NAO hardware.
{form}
"""


def write_page(docs: Path) -> Path:
    """Write results.md and its figures from results.csv; the path of the page."""
    results = load(docs / "results.csv")
    commits = sorted({each.commit for each in results.values()})
    form = f"Measured at commit {commits[0]}." if len(commits) == 1 else ""
    if quick := [name for name, each in results.items() if each.head["quick"]]:
        form += f" In the quick form, few robots and short windows: {', '.join(quick)}."
    rows = sum(len(each.rows) for each in results.values())
    parts = [INTRODUCTION.format(form=form, sections=len(results), rows=rows)]
    for table in results_plan().page:
        parts += _table(table, results, docs)
    page = docs / "results.md"
    page.write_text("\n".join(parts), encoding="utf-8")
    return page


def _table(table: PageTable, results: Mapping[str, Measured], docs: Path) -> Iterator[str]:
    used: dict[str, None] = {}
    values = {f"{name}/{metric}": value for name, each in results.items()
              for metric, value in each.values.items()}  # fmt: skip

    def cell(pattern: str, line: str) -> Cell:
        text = pattern.replace("{}", line)
        source, colon, key = text.partition(":")
        if colon:
            return PUBLISHED[source].get(key, "")
        for key in text.split("|"):
            if key in values:
                used.setdefault(key.partition("/")[0])
                return values[key]
        return ""

    lines: Mapping[str, str]
    if isinstance(table.lines, str):
        sweep = load_sweep(share("config", "bench", f"{table.lines}.yaml"))
        lines = {name.replace("_", " "): name for name, each in sweep.variants.items()
                 if not each.trials}  # fmt: skip
    else:
        lines = table.lines
    body = [[label, *(cell(pattern, line) for pattern in table.columns.values())]
            for label, line in lines.items()]  # fmt: skip
    body = [line for line in body if any(each != "" for each in line[1:])]
    if not used:
        return
    if table.title:
        yield f"## {table.title}\n"
    if table.text:
        yield f"{table.text}\n"
    if stale := [name for name in used if results[name].head["stale"]]:
        names = "" if len(stale) == len(used) else f" ({', '.join(stale)})"
        yield f"> **Earlier walk**{names}.\n"
    if table.figure in results:
        drawn = push_figure(results[table.figure].values, docs / "images" / "bench_push.png")
        if drawn is not None:
            yield f"![Largest survived impulse by direction](images/{drawn.name})\n"
    yield table_text(["", *table.columns], body, markdown=True) + "\n"
    if isinstance(table.lines, str):
        yield from _with_and_without(sweep, results[table.lines].values)
    commands = dict.fromkeys(results[name].head["command"] for name in used)
    yield "```\n" + "\n".join(commands) + "\n```\n"


def _with_and_without(sweep: Sweep, values: Mapping[str, float | None]) -> Iterator[str]:
    """The first metric of each trial of an ablation, with an extension and without it."""
    found = [
        (f"{name.removeprefix('without_')}_{sweep.trials[trial].metrics[0]}")
        for name, change in sweep.variants.items()
        for trial in change.trials
    ]
    body: list[list[Cell]] = [
        [name.replace("_of_upright", "").replace("_survival", "").replace("_", " "),
         values.get(f"{name}_with"), values.get(f"{name}_without")]
        for name in found
    ]  # fmt: skip
    if body:
        yield "In the trial that it exists for (more in results.csv):\n"
        yield table_text(["extension and metric", "with", "without"], body, markdown=True) + "\n"
