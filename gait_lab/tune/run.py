"""`nao_gait tune`: one study from its file to a preset, figures and a report."""

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from gait_lab.tune import report
from gait_lab.tune.confirm import Candidate, Comparison, compare, finals
from gait_lab.tune.evaluation import Trial
from gait_lab.tune.methods import Method, make_method
from gait_lab.tune.search import best_of, search, window_for
from gait_lab.tune.store import Store
from gait_lab.tune.study import Place, Study, load_study
from gait_lab.tune.workers import Workers, check_backend, make_workers
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.plant import load_plant
from sim_bridge.trials.parallel import workers as worker_count
from sim_bridge.world import World

FIXED = ("study", "method", "seed")
"""Properties that a resumed study must have in common with the stored one."""


@dataclass(frozen=True, slots=True)
class TuneOptions:
    """Options of the command.

    Attributes:
        study: Name or file of the study.
        method: Search method; None for that of the study.
        trials: Number of trials; None for that of the study.
        workers: Number of processes; None for all cores.
        backend: `loky`, `ray` or `dask`.
        address: Address of a running cluster.
        resume: Whether to continue the study in `out`.
        out: Folder for the results; None for `out/tune/STUDY`.
        seed: Seed of the method.
        engine: Physics engine of the search; None for that of the study.
        confirm: Whether to confirm the winner on unseen robots.
        places: Where to confirm it, as ENGINE/PLANT; empty for the places of the study.
    """

    study: str
    method: str | None = None
    trials: int | None = None
    workers: int | None = None
    backend: str = "loky"
    address: str | None = None
    resume: bool = False
    out: Path | None = None
    seed: int = 0
    engine: str | None = None
    confirm: bool = True
    places: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Result:
    """A finished study.

    Attributes:
        study: The study.
        trials: All trials by number.
        best: The winner.
        candidates: Candidates of the finals, the winner first; empty without finals.
        comparisons: Comparison with the start in each place; empty without a confirmation.
        folder: Folder of the results.
    """

    study: Study
    trials: tuple[Trial, ...]
    best: Trial
    candidates: tuple[Candidate, ...]
    comparisons: tuple[Comparison, ...]
    folder: Path


def run(options: TuneOptions, say: Callable[[str], None]) -> Result:
    """Search, confirm the winner, and write the results.

    Args:
        options: Options of the command.
        say: Prints a line.

    Returns:
        The finished study.

    Raises:
        NaoGaitError: If the study or an option is invalid; raised before the first trial.
    """
    study = load_study(options.study, options.engine, options.trials, options.places)
    count = worker_count(options.workers)
    check_backend(options.backend, options.address)
    name = options.method or study.method
    method = make_method(
        name, study.start_point, seed=options.seed, trials=study.trials
    )
    confirming = options.confirm and bool(study.unseen)
    _try_places(study, confirming)
    out = options.out or Path("out", "tune", study.name)
    store = _open(study, replace(options, method=name), out, window_for(count), say)
    window = int(store.about["window"])
    try:
        workers = make_workers(options.backend, count, options.address)
        try:
            trials = _search(study, method, store, workers, window, say)
            candidates = _finals(study, trials, workers)
            best = candidates[0].trial if candidates else best_of(trials)
            comparisons = _confirm(study, best, workers) if confirming else []
        finally:
            workers.close()
        result = Result(
            study, tuple(trials), best, tuple(candidates), tuple(comparisons), out
        )
        _write(result, store.about, say)
    finally:
        store.close()
    return result


def digest(study: Study) -> str:
    """Return a hash of everything on which a trial depends; not of the number of trials."""
    relevant = (
        study.ranges, study.start, study.protocol, sorted(study.options.items()),
        sorted(study.objective.items()), study.penalty, study.robots, study.engine, study.plant,
        study.urdf,
    )  # fmt: skip
    return hashlib.sha256(repr(relevant).encode()).hexdigest()[:16]


def _open(
    study: Study, options: TuneOptions, out: Path, window: int, say: Callable[[str], None]
) -> Store:
    about = {
        "study": f"{study.name} {digest(study)}",
        "method": str(options.method),
        "seed": str(options.seed),
        "window": str(window),
        "trials": str(study.trials),
        "version": report.code_version(),
        "robots": json.dumps(study.robots),
        "text": study.source,
    }
    if not options.resume:
        return Store.create(out, about)
    store = Store.reopen(out)
    stored = store.about
    for key in FIXED:
        if stored[key] != about[key]:
            store.close()
            raise NaoGaitError(
                f"resume: {key}", about[key], f"{stored[key]}, as in {out}; or another --out"
            )
    if stored["version"] != about["version"]:
        say(f"note: the stored trials are of version {stored['version']}")
    return store


def _try_places(study: Study, confirming: bool) -> None:
    """Build the robot once in every place, because an engine may refuse a plant."""
    places = {Place(study.engine, study.plant), *(study.confirm_places if confirming else ())}
    robot = load_robot(study.urdf)
    for place in sorted(places, key=str):
        World.single(robot, load_plant(place.plant), engine=place.engine).close()


def _search(
    study: Study, method: Method, store: Store, workers: Workers, window: int,
    say: Callable[[str], None],
) -> list[Trial]:  # fmt: skip
    from tqdm import tqdm

    stored = {trial.number for trial in store.trials()}
    best: Trial | None = None
    began = time.perf_counter()
    with tqdm(total=study.trials, desc=study.name, disable=None, leave=False) as bar:

        def note(trial: Trial) -> None:
            nonlocal best
            if best is None or trial.score > best.score:
                best = trial
            bar.set_postfix_str(f"best {best.score:.3f} (trial {best.number})", refresh=False)
            bar.update()

        trials = search(study, method, store, workers, window=window, note=note)
    seconds = time.perf_counter() - began
    new = [trial for trial in trials if trial.number not in stored]
    say(report.pace_line(new, seconds, workers.count))
    for trial in trials:
        if trial.error is not None:
            say(f"trial {trial.number} failed: {trial.error}")
    return trials


def _finals(study: Study, trials: list[Trial], workers: Workers) -> list[Candidate]:
    from tqdm import tqdm

    total = study.finals.candidates * len(study.finals.robots)
    with tqdm(total=total, desc="finals", disable=None, leave=False) as bar:
        return finals(study, trials, workers, bar.update)


def _confirm(study: Study, best: Trial, workers: Workers) -> list[Comparison]:
    from tqdm import tqdm

    total = 2 * len(study.unseen) * len(study.confirm_places)
    with tqdm(total=total, desc="unseen robots", disable=None, leave=False) as bar:
        return compare(study, study.parameters_at(best.point), workers, bar.update)


def _write(result: Result, about: dict[str, str], say: Callable[[str], None]) -> None:
    study, trials, best, out = result.study, result.trials, result.best, result.folder
    found = report.importance(study, trials)
    title = f"{study.name}, {about['method']}, seed {about['seed']}"
    report.convergence_figure(trials, title, out / "convergence.png")
    report.importance_figure(found, out / "importance.png")
    report.pairs_figure(study, trials, out / "pairs.png")

    start = trials[0]
    provenance = [
        f"Tuned: {study.about or study.name}.",
        f"study {about['study']}, method {about['method']}, seed {about['seed']}, "
        f"trial {best.number} of {len(trials)}",
        f"version {about['version']}",
        f"tuned on {study.engine}/{study.plant}, robots {_seeds(study.robots)}: "
        f"score {start.score:.3f} -> {best.score:.3f}",
        *(
            [f"medians over unseen robots {_seeds(study.unseen)}, before -> after:"]
            if result.comparisons
            else ["not confirmed on unseen robots"]
        ),
        *(f"  {report.unseen_line(study, each)}" for each in result.comparisons),
    ]
    preset = report.write_preset(
        out / "best.yaml",
        study.parameters_at(best.point),
        study.values_at(best.point),
        provenance,
    )
    text = [*provenance, "", *report.winner_lines(study, start, best, found)]
    text += ["", *report.finals_lines(study, result.candidates)]
    for comparison in result.comparisons:
        text += ["", *report.comparison_table(study, comparison)]
    (out / "report.txt").write_text("\n".join(text) + "\n", encoding="utf-8")
    say("\n".join(text))
    say(f"\n{preset}, report.txt, convergence.png, importance.png and pairs.png in {out}")


def _seeds(robots: tuple[int, ...]) -> str:
    consecutive = len(robots) > 2 and list(robots) == list(range(robots[0], robots[-1] + 1))
    return f"{robots[0]}..{robots[-1]}" if consecutive else " ".join(map(str, robots))
