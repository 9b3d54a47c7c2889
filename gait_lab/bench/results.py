"""`nao_gait results`: docs/results.md and docs/results/*.json, measured on one commit.

A section is one run of a suite. Its file holds the commit, the command, the rows, the tables and
the fingerprints of the walks that the figures depend on. A finished section of the same commit,
command and fingerprints is not run again, and a campaign keeps its finished runs in `KEPT`, so an
interrupted run continues where it stopped. The page is written from the files alone.
"""

import hashlib
import json
import subprocess
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import gait_lab
from gait_lab.bench.figures import crossing_figure, delay_figure, push_figure, speed_figure
from gait_lab.bench.fingerprint import Fingerprint, fingerprints_of
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.published import PUBLISHED_NOTE
from gait_lab.bench.result import Column, Table
from gait_lab.bench.suite import Run, find_suite, plan
from gait_lab.bench.suites.rough import WALKERS as CROSSING_ROBOTS
from nao_lipm_gait.presets import preset_for
from robot_core.errors import NaoGaitError
from sim_bridge.trials.crossing import CrossingSpec
from sim_bridge.trials.trial import loaded_robot

ROOT = Path(gait_lab.__file__).resolve().parents[1]
CODE = (
    "config", "gait_lab", "lola_bridge", "nao_lipm_gait", "nao_soccer", "robot_core", "sim_bridge",
    "urdf",
)  # fmt: skip
"""What the figures depend on; other files may change without making a result old."""
KEPT = ROOT / "build" / "results"
"""Finished runs of the campaigns."""
REPORTED = {"robots": 20, "seed": 40, "engine": "mujoco"}
"""Robots 40 to 59. The parameters were chosen on robots 0 to 39."""
WALK = "mujoco/walk/default"
V6_WALK = "mujoco/walk/nao_v6"
SOCCER = (WALK, "mujoco/soccer/play")
Values = Mapping[str, float | None]


@dataclass(frozen=True, slots=True)
class Section:
    """One run of a suite on the page.

    Attributes:
        name: Name of its file, also for `--only`.
        title: Heading.
        suite: Name of the suite.
        full: Its options, besides `REPORTED`.
        quick: What differs in the quick form.
        walks: Keys of the reference rollouts that the figures depend on.
        figure: Draws values of metrics to a file; None without a figure.
        picture: Name of a file in images/, and what draws it after the run.
        caption: Caption of the figure or picture.
        of_this_machine: The figures depend on the machine.
    """

    name: str
    title: str
    suite: str
    full: Mapping[str, Any] = field(default_factory=dict)
    quick: Mapping[str, Any] = field(default_factory=dict)
    walks: tuple[str, ...] = (WALK,)
    figure: Callable[[Values, Path], Path | None] | None = None
    picture: tuple[str, Callable[[Path], object]] | None = None
    caption: str = ""
    of_this_machine: bool = False

    def plan(self, quick: bool, placo_python: str | None = None, jobs: int | None = None) -> Run:
        """The run of this section; raises NaoGaitError if its input is bad."""
        taken = find_suite(self.suite).taken
        given = {name: value for name, value in REPORTED.items() if name in taken}
        given |= {**self.full, **(self.quick if quick else {})}
        given |= {"jobs": jobs} if jobs is not None else {}
        if "placo_python" in taken:
            given["placo_python"] = placo_python
        (run,) = plan(self.suite, given)
        return run


def _cross_a_field(path: Path) -> None:
    robot = next(each for each in CROSSING_ROBOTS if each.name == "bruno_fast")
    parameters = preset_for(loaded_robot(robot.urdf), robot.preset)
    spec = CrossingSpec(robot, parameters=parameters, robot_seed=50, engine="mujoco")
    crossing_figure(spec, path)


_FEW = {"robots": 4, "window": 4.0}
_ONE_LOOP = {"open_loop": "off"}
_V6_OPTIONS = {**_ONE_LOOP, "half_speed": False, "window": 8.0}
_LATE = "Median errors by the delay of the images; grey: the filters do not know the delay."
_SHORT_TRIALS = {"robots": 2, "window": 30.0}
_PUSH = "Largest impulse that is survived, by the direction of the push; ahead is up."
SECTIONS = (
    Section("speed", "Speed", "speed", quick={"robots": 6, "window": 5.0}, figure=speed_figure,
            caption="Bars: median of the robots. The line ends at the worst one."),
    Section("speed_pybullet", "Speed in PyBullet", "speed", {"engine": "pybullet"},
            {**_FEW, **_ONE_LOOP, "half_speed": False}, ("pybullet/walk/default",)),
    Section("speed_worn", "Speed on worn joints", "speed",
            {"plant": "worn", "tasks": ("forward=33", "back=25", "side=13", "turn=80")},
            {"robots": 6, "window": 5.0, "half_speed": False, **_ONE_LOOP}),
    Section("speed_v6", "Speed of a NAO V6", "speed", {"urdf": "nao_v6", **_V6_OPTIONS},
            _FEW, (V6_WALK,)),
    Section("speed_v6_12ms", "Speed of a NAO V6 in LoLA's period", "speed",
            {"urdf": "nao_v6", "control_period": 0.012, **_V6_OPTIONS}, _FEW, (V6_WALK,)),
    Section("soles", "Level soles", "soles", {"robots": 40}),
    Section("paper", "The results of the first paper", "paper", {},
            {"robots": 6, "window": 5.0, "push": False},
            (WALK, "mujoco/walk/paper")),
    Section("odometry", "Odometry", "odometry", {}, {"robots": 4}),
    Section("odometry_v6", "Odometry with a yaw gyro", "odometry",
            {"urdf": "nao_v6", "courses": ("tour",)}, {"robots": 4}, (V6_WALK,)),
    Section("error", "Error of the centre of mass", "error", quick={"robots": 3, "window": 5.0}),
    Section("push_spot", "Pushes on the spot", "push", {"robots": 10, "tasks": ("spot",)},
            {"robots": 4, "phases": 4, "directions": ("forward", "left", "back", "right")},
            figure=push_figure, caption=_PUSH),
    Section("push_walking", "Pushes while walking", "push",
            {"robots": 10, "tasks": ("forward=20",)},
            {"robots": 4, "phases": 4, "impulses": (1.25,)}),
    Section("start", "Starts and stops", "start", quick={"robots": 6, **_ONE_LOOP}),
    Section("endurance", "Endurance", "endurance", {"metres": 100.0},
            {"robots": 8, "metres": 5.0}),
    Section("robust", "Harder plants", "robust", {"tasks": ("forward=30", "forward=47")},
            {"robots": 6, "window": 5.0, **_ONE_LOOP}),
    Section("delay", "Late sensors", "delay", {"robots": 4},
            {**_FEW, "tasks": ("forward=20",), **_ONE_LOOP}),
    Section("loss", "Lost messages", "loss", quick={"robots": 3, "window": 10.0},
            walks=(WALK, "mujoco/fault/loss")),
    Section("loss_wander", "Sensors whose age wanders", "loss",
            {"loss": 0.0, "wander": 80.0, "plant_options": (("sensors.delay", 0.02),)},
            {"robots": 3, "window": 10.0}, (WALK, "mujoco/fault/wandering_age")),
    Section("loss_wander_hold", "Sensors whose age wanders, without walking on", "loss",
            {"loss": 0.0, "wander": 80.0, "plant_options": (("sensors.delay", 0.02),),
             "coast": False},
            {"robots": 3, "window": 10.0}, (WALK, "mujoco/fault/wandering_age")),
    Section("loss_15", "Lost messages, 15 %", "loss", {"loss": 15.0},
            {"robots": 3, "window": 10.0}, (WALK, "mujoco/fault/loss")),
    Section("loss_20", "Lost messages, 20 %", "loss", {"loss": 20.0},
            {"robots": 3, "window": 10.0}, (WALK, "mujoco/fault/loss")),
    Section("faults", "Faults in the middle of a walk", "faults", {"runs": 10_000},
            {"runs": 56}, (WALK, "mujoco/fault/imu_outage", "mujoco/fault/frozen")),
    Section("faults_soccer", "Faults in the middle of a match", "faults", {"scope": "soccer"},
            {"runs": 4}, SOCCER),
    Section("faults_robot", "Faults of the nodes", "faults", {"scope": "robot"}, {"runs": 3},
            SOCCER),
    Section("ablation", "One extension at a time", "ablation", {"robots": 10},
            {"robots": 2, "window": 4.0, "phases": 2, "tasks": ("forward",)},
            (WALK, "mujoco/walk/paper")),
    Section("posture", "Posture control of Bruno", "posture", {},
            {"robots": 2, "window": 5.0}, ("mujoco/walk/bruno",)),
    Section("getup", "Getting up", "getup", quick={"robots": 6, "attempts": 1},
            walks=(WALK, "mujoco/motion/nao_h21_v33/get_up_back",
                   "mujoco/motion/nao_h21_v33/get_up_front")),
    Section("kick", "Kicks", "kick", quick={"robots": 6},
            walks=("mujoco/motion/nao_h21_v33/kick_front_right",
                   "mujoco/motion/nao_h21_v33/kick_side_right")),
    Section("rough", "Rough ground", "rough", quick={"robots": 8, **_ONE_LOOP},
            picture=("rough_fast.png", _cross_a_field), caption="The walk bruno fast of robot 50.",
            walks=("mujoco/walk/rough_fast", "mujoco/walk/rough_slow", "mujoco/walk/bruno", WALK)),
    Section("vision", "Vision", "vision", {"robots": 8}, {"robots": 1, "window": 1.5}),
    Section("vision_pybullet", "Vision in PyBullet", "vision", {"robots": 8, "engine": "pybullet"},
            {"robots": 1, "window": 1.0}, ("pybullet/walk/default",)),
    Section("localization", "Self-localisation", "localization", quick=_SHORT_TRIALS,
            walks=SOCCER, figure=delay_figure, caption=_LATE),
    Section("localization_spl", "Self-localisation on the SPL field", "localization",
            {"scene": "pitch", "ablation": False}, _SHORT_TRIALS, SOCCER),
    Section("ball", "Ball", "ball", quick=_SHORT_TRIALS, walks=SOCCER, figure=delay_figure,
            caption=_LATE),
    Section("behavior", "Goals of a robot alone", "behavior", {"attempts": 2}, {"robots": 2},
            SOCCER),
    Section("behavior_rendered", "Goals of a robot alone by rendered images", "behavior",
            {"robots": 8, "rendered": True}, {"robots": 1}, SOCCER),
    Section("keeper", "Shots at a keeper", "keeper", quick={"robots": 2},
            walks=(*SOCCER, "mujoco/motion/nao_h21_v33/dive_left",
                            "mujoco/motion/nao_h21_v33/dive_right")),
    Section("scenes", "Backheel, and two at the ball", "scenes", quick={"robots": 2},
            walks=SOCCER),
    Section("challenges", "Technical challenges", "challenges", quick={"robots": 1},
            walks=SOCCER),
    Section("match", "Matches", "match", {"robots": 10}, {"robots": 1, "minutes": 0.25}, SOCCER),
    Section("match_roles", "Matches with roles against without", "match",
            {"robots": 10, "minutes": 0.5, "red_alone": True}, {"robots": 1, "minutes": 0.25},
            SOCCER),
    Section("match_silence", "Matches with lost messages and a silent referee", "match",
            {"robots": 4, "minutes": 0.5, "loss": 0.3, "silence": 10.0},
            {"robots": 1, "minutes": 0.25}, SOCCER),
    Section("compute", "Cost of control", "compute", {}, {"window": 10.0},
            of_this_machine=True),
    Section("realtime", "Ticks on a busy machine", "realtime", {}, {"window": 5.0},
            of_this_machine=True),
    Section("peers", "Other walks on the same robots", "peers", {},
            {"robots": 2, "window": 4.0, "phases": 2},
            (WALK, "mujoco/walk/paper", "mujoco/walk/zmp", "mujoco/walk/preview")),
)  # fmt: skip
INTRODUCTION = """\
# Results

Written by `nao_gait results` from the files in [results/](results). Each table is followed by the
command that measures it again (after `source .venv/bin/activate`). With the compiled gait, which
walks as the Python code does, to the bit, it is faster: `nao_gait bench kick --seed 40 --engine
mujoco` is then `make bench ARGS="kick --seed 40 --engine mujoco"`. Physics and noise have seeds:
the same walk gives the same figures, with any number of processes (`--jobs`; all cores). Results of
earlier commits are kept while the reference walks are the same (`nao_gait fingerprint`). {form}

- A *robot* is an individual drawn from the plant: joint zero errors, sensor biases, masses,
  friction, motor strength ([plants.md](plants.md)). *Worst* is the slowest robot, for errors and
  slip that with the largest value; *median* is over the robots. The parameters were chosen on
  robots 0 to 39, some also on 100 to 169; the robots here are others.
- *Closed* is the gait with its feedback. *Open* is the same gait with the same parameters on the
  same robots without feedback (`feedback: false`).
- A speed *counts* only if no robot falls, at most 5 % of the ticks are without a loaded foot, the
  loaded sole slips at most 3 cm/s, and the legs do not touch.
- A *fall* is a torso tilt over 45 deg or a torso below half of its standing height. The gait
  *detects* a fall when its own state says so; the lead is 0 for a fall that it did not detect
  before. A detection relaxes the joints and thereby causes the fall, so few false alarms do not yet
  prove a good detection.
- {published}
"""
STALE = "**Measured on an earlier walk.** The walk has changed since; these figures are kept until "
STALE += "they are measured again."


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
    """Options of `nao_gait results`.

    Attributes:
        docs: Folder of results.md, results/ and images/.
        only: Names of sections; empty for all.
        quick: Few robots and short windows.
        allow_dirty: Measure although `CODE` has changes that are not committed.
        placo_python: Python of an environment with placo; without it the section `peers` is left
            out.
        jobs: Processes; None for all cores.
    """

    docs: Path = ROOT / "docs"
    only: tuple[str, ...] = ()
    quick: bool = False
    allow_dirty: bool = False
    placo_python: str | None = None
    jobs: int | None = None

    @property
    def sections(self) -> tuple[Section, ...]:
        """The sections to run; raises NaoGaitError for an unknown name."""
        names = [section.name for section in SECTIONS]
        for name in self.only:
            if name not in names:
                raise NaoGaitError("only", name, f"one of {', '.join(names)}")
        if "peers" in self.only and self.placo_python is None:
            raise NaoGaitError(
                "placo-python", "", "a Python with placo (required by the section peers)"
            )
        left_out = () if self.placo_python else ("peers",)
        wanted = self.only or [name for name in names if name not in left_out]
        return tuple(section for section in SECTIONS if section.name in wanted)


def measure(options: ResultsOptions, out: Callable[[str], None] = print) -> None:
    """Run the sections that are not finished, write their files and the page.

    Args:
        options: What to run.
        out: Prints a text.

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
    runs = [each.plan(options.quick, options.placo_python, options.jobs) for each in sections]
    keys = dict.fromkeys(key for section in sections for key in section.walks)
    found = fingerprints_of(keys, options.jobs)
    times = []
    for number, (section, run) in enumerate(zip(sections, runs, strict=True), 1):
        command = run.command
        if options.placo_python is not None:
            command = command.replace(options.placo_python, "placo-env/bin/python")
        head: dict[str, Any] = {
            "section": section.name, "title": section.title, "commit": code.commit,
            "changes": code.changes, "command": command, "quick": options.quick, "stale": False,
            "fingerprints": {key: found[key].as_list() for key in section.walks},
        }  # fmt: skip
        file = options.docs / "results" / f"{section.name}.json"
        label = f"[{number}/{len(sections)}] {section.name}"
        if _is_finished(file, head, found):
            out(f"{label}: finished before")
            continue
        out(f"{label}: {command}")
        began = time.monotonic()
        result = run.suite.measure(_resumed(run, head))
        took = time.monotonic() - began
        times.append((section.name, took))
        content = {
            **head, "took": round(took, 1), "title_of_run": result.title,
            "of_this_machine": section.of_this_machine,
            "tables": [table.as_dict() for table in result.tables], "notes": list(result.notes),
            "rows": result.as_rows(run.suite.name, run.options),
        }  # fmt: skip
        _write_json(file, content)
        if section.picture is not None:
            name, draw = section.picture
            draw(_images(options.docs) / name)
        write_page(options.docs)
        out(f"{result.text}\n{section.name}: took {took:.0f} s\n")
    write_page(options.docs)
    if times:
        rows = [*times, ("all", sum(took for _, took in times))]
        out(Table((Column("section"), Column("took", "s", 0)), rows).text())
    out(f"wrote {options.docs / 'results.md'}")


def _resumed(run: Run, head: Mapping[str, Any]) -> BenchOptions:
    """The options of a run, with the file of its finished runs if it is a campaign."""
    if "keep" not in run.suite.taken:
        return run.options
    parts = (head["commit"], head["changes"], head["command"], head["fingerprints"])
    name = hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:12]
    KEPT.mkdir(parents=True, exist_ok=True)
    file = KEPT / f"{head['section']}-{name}.jsonl"
    options: BenchOptions = replace(run.options, keep=str(file))  # type: ignore[call-arg]
    return options


def _is_finished(file: Path, head: Mapping[str, Any], found: Mapping[str, Fingerprint]) -> bool:
    if not file.is_file():
        return False
    before = load(file)
    same = all(before[key] == head[key] for key in ("commit", "changes", "command", "stale"))
    return same and is_current(before, found)


def load(file: Path) -> dict[str, Any]:
    """The content of a results file; raises NaoGaitError if it is none."""
    try:
        content: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        content["commit"], content["fingerprints"], content["rows"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise NaoGaitError("results", str(file), f"a file of nao_gait results ({error})") from error
    return content


def is_current(content: Mapping[str, Any], found: Mapping[str, Fingerprint]) -> bool:
    """Whether the walks of a results file are those of the present code."""
    stored: Mapping[str, Sequence[Any]] = content["fingerprints"]
    same = all(key in found and found[key].is_same_walk(each) for key, each in stored.items())
    return same and set(_walks_of(content)) <= set(stored)


def _walks_of(content: Mapping[str, Any]) -> Sequence[str]:
    """The walks that a results file depends on by the present code."""
    return next((each.walks for each in SECTIONS if each.name == content.get("section")), ())


def outdated(files: Iterable[Path], jobs: int | None = None, show: bool = True) -> list[Path]:
    """The results files whose walks have changed and that are not marked as stale.

    Args:
        files: Results files.
        jobs: Processes; None for all cores.
        show: Show a progress bar.

    Returns:
        Those that have to be measured again, or marked.
    """
    contents = {file: load(file) for file in files}
    contents = {file: content for file, content in contents.items() if not content["stale"]}
    keys = dict.fromkeys(key for each in contents.values() for key in each["fingerprints"])
    found = fingerprints_of(keys, jobs, show)
    return [file for file, content in contents.items() if not is_current(content, found)]


def mark_stale(options: ResultsOptions, out: Callable[[str], None] = print) -> None:
    """Mark the results whose walks have changed, with a visible note on the page.

    Args:
        options: The folder; `only` limits the files.
        out: Prints a text.
    """
    files = sorted((options.docs / "results").glob("*.json"))
    files = [file for file in files if not options.only or file.stem in options.only]
    marked = outdated(files, options.jobs)
    for file in marked:
        _write_json(file, {**load(file), "stale": True})
        out(f"stale: {file}")
    write_page(options.docs)
    out(f"{len(files)} results, {len(marked)} newly marked as stale")


def write_page(docs: Path) -> Path:
    """Write results.md and its figures from the files in results/; the path of the page."""
    files = (docs / "results" / f"{section.name}.json" for section in SECTIONS)
    contents = {file.stem: load(file) for file in files if file.is_file()}
    one_commit = _one_commit(contents.values())
    form = "All sections" if one_commit else "Sections that name no other commit"
    form += " were measured at commit {}."
    commits = [_commit(content) for content in contents.values() if not content["stale"]]
    form = form.format(f"`{commits[0]}`") if commits else ""
    quick = [content["title"] for content in contents.values() if content["quick"]]
    if quick:
        form += f" Measured in the quick form, few robots and short windows: {', '.join(quick)}."
    parts = [INTRODUCTION.format(form=form.strip(), published=PUBLISHED_NOTE)]
    for section in SECTIONS:
        if section.name in contents:
            parts += _section(section, contents[section.name], docs, commits[:1])
    parts += _took(contents.values())
    page = docs / "results.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text("\n".join(parts), encoding="utf-8")
    return page


def _section(
    section: Section, content: Mapping[str, Any], docs: Path, commit: Sequence[str]
) -> list[str]:
    parts = [f"## {section.title}\n"]
    if content["stale"]:
        parts.append(f"> {STALE} Commit `{_commit(content)}`.\n")
    elif _commit(content) not in commit:
        parts.append(f"> Measured at commit `{_commit(content)}`.\n")
    if section.of_this_machine:
        parts.append("These times depend on the machine.\n")
    drawn = None
    if section.figure is not None:
        values = {row["metric"]: row["value"] for row in content["rows"]}
        drawn = section.figure(values, _images(docs) / f"bench_{section.suite}.png")
    elif section.picture is not None:
        drawn = _images(docs) / section.picture[0]
    if drawn is not None and drawn.is_file():
        parts.append(f"![{section.caption}](images/{drawn.name})\n\n{section.caption}\n")
    parts.append(f"{content['title_of_run']}.\n")
    parts += [Table.of(table).text(markdown=True) + "\n" for table in content["tables"]]
    notes = (note for note in content["notes"] if note != PUBLISHED_NOTE)
    parts += [f"- {note.replace('<', '&lt;')}" for note in notes]
    parts.append(f"\n```\n{content['command']}\n```\n")
    return parts


def _took(contents: Iterable[Mapping[str, Any]]) -> list[str]:
    rows = [(content["title"], content["took"]) for content in contents if "took" in content]
    if not rows:
        return []
    rows.append(("all of these", sum(took for _, took in rows)))
    table = Table((Column("section"), Column("took", "s", 0)), rows)
    text = "Seconds of wall time, on the machine that measured it, with its other load.\n"
    return ["## What took how long\n", text, table.text(markdown=True) + "\n"]


def _images(docs: Path) -> Path:
    folder = docs / "images"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _commit(content: Mapping[str, Any]) -> str:
    changed = " with uncommitted changes" if content["changes"] else ""
    return f"{content['commit'][:12]}{changed}"


def _one_commit(contents: Iterable[Mapping[str, Any]]) -> bool:
    return len({_commit(content) for content in contents}) <= 1


def _write_json(file: Path, content: Mapping[str, Any]) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        # In one step: an interrupted run leaves no partial file.
        new = file.with_suffix(".new")
        new.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        new.replace(file)
    except OSError as error:
        raise NaoGaitError("results", str(file), f"a file that can be written ({error})") from error
