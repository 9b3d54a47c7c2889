"""`nao_gait tune`: one study from its file to a preset and a report."""

import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from optuna.trial import FrozenTrial

from gait_lab.tune import report
from gait_lab.tune.confirm import Candidate, Comparison, compare, finals
from gait_lab.tune.search import (
    DATABASE,
    Kept,
    best_of,
    leading,
    one_line_storage_errors,
    search,
)
from gait_lab.tune.study import METHODS, Place, Study, load_study
from gait_lab.tune.workers import Workers
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.plant import load_plant
from sim_bridge.trials.parallel import workers as worker_count
from sim_bridge.world import World


@dataclass(frozen=True, slots=True)
class TuneOptions:
    """Options as the command line explains them; None takes what the study says, or the default."""

    study: str
    method: str | None = None
    trials: int | None = None
    workers: int | None = None
    resume: bool = False
    join: bool = False
    storage: str | None = None
    out: Path | None = None
    seed: int = 0
    engine: str | None = None
    urdf: str | None = None
    confirm: bool = True
    places: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Result:
    """A finished study.

    Attributes:
        study: The study.
        trials: All trials with a score, by number.
        best: The winner.
        candidates: Candidates of the finals, the winner first; empty without finals.
        comparisons: Comparison with the start in each place; empty without a confirmation.
    """

    study: Study
    trials: Sequence[FrozenTrial]
    best: FrozenTrial
    candidates: Sequence[Candidate]
    comparisons: Sequence[Comparison]


def command(say: Callable[[str], None], *, places: Sequence[str], **options: Any) -> None:
    """Run with the fields of `TuneOptions`."""
    run(TuneOptions(places=tuple(places), **options), say)


def run(options: TuneOptions, say: Callable[[str], None]) -> Result | None:
    """Search, confirm the winner, and write the results.

    Args:
        options: Options of the command.
        say: Prints a line.

    Returns:
        The finished study; None for a tuner that only helped.

    Raises:
        NaoGaitError: The study or an option is invalid, which is raised before the first trial; or
            the results cannot be written.
    """
    study = load_study(
        options.study, options.engine, options.trials, options.places, options.urdf
    )
    count = worker_count(options.workers)
    method = study.file.method if options.method is None else options.method
    _check_method(method, options.seed, len(study.file.parameters))
    if options.resume and options.join:
        raise NaoGaitError("join", True, "--join or --resume, not both")
    confirming = options.confirm and bool(study.file.unseen) and not options.join
    _try_places(study, confirming)
    out = options.out or Path("out", "tune", study.name)
    database = out / DATABASE
    existing = options.resume or options.join
    if options.storage is None and existing != database.is_file():
        free = "a folder without a study; or --resume this one"
        allowed = f"a folder with a {DATABASE}" if existing else free
        raise NaoGaitError("out", str(out), allowed)
    url = options.storage or f"sqlite:///{database}"
    about = {"study": f"{study.name} {study.digest()}", "method": method, "seed": options.seed}
    if options.storage and not options.join:
        # The lock on the folder guards the storage only if there is one folder.
        about["leader"] = f"{platform.node()}:{out.resolve()}"
    with one_line_storage_errors("the storage" if options.storage else str(out)):
        if options.join:
            kept = Kept(study, url)
            kept.open(about, existing=True)
            with Workers(count) as workers:
                _search(study, kept, workers, method, options.seed, helping=True)
            return None
        with leading(out):
            kept = Kept(study, url)
            kept.open(about, existing=options.resume and not kept.empty())
            with Workers(count) as workers:
                trials = _search(study, kept, workers, method, options.seed)
                candidates = finals(study, trials, workers)
                best = candidates[0].trial if candidates else best_of(trials)
                winner = study.start.replace(**best.params)
                comparisons = compare(study, winner, workers) if confirming else []
            result = Result(study, trials, best, candidates, comparisons)
            _write(result, kept, out, say)
    return result


def _check_method(method: str, seed: int, parameters: int) -> None:
    if method not in METHODS:
        raise NaoGaitError("method", method, ", ".join(METHODS))
    if method == "cma" and parameters < 2:
        raise NaoGaitError("method", method, "another one for a single parameter")
    if seed < 0:
        raise NaoGaitError("seed", seed, "0 or more")


def _try_places(study: Study, confirming: bool) -> None:
    """Build the robot once in every place, because an engine may refuse a plant."""
    places: set[Place] = {study.place, *(study.confirm_places if confirming else ())}
    robot = load_robot(study.file.urdf)
    for place in sorted(places):
        World.single(robot, load_plant(place.plant), engine=place.engine).close()


def _search(
    study: Study, kept: Kept, workers: Workers, method: str, seed: int, helping: bool = False
) -> list[FrozenTrial]:
    from sim_bridge.trials.progress import Progress

    done = kept.complete()
    best = max((trial.value or 0.0 for trial in done), default=float("-inf"))
    with Progress(total=study.file.trials, initial=len(done), desc=study.name) as bar:

        def note(number: int, score: float) -> None:
            nonlocal best
            best = max(best, score)
            bar.set_postfix_str(f"best {best:.3f}", refresh=False)
            bar.update()

        return search(study, kept, workers, method, seed, helping=helping, note=note)


def _write(result: Result, kept: Kept, out: Path, say: Callable[[str], None]) -> None:
    study, trials, best = result.study, result.trials, result.best
    about = kept.trials.user_attrs["about"]
    provenance = [
        f"Tuned: {' '.join(study.file.about.split()) or study.name}.",
        f"study {about['study']}, method {about['method']}, seed {about['seed']}, "
        f"trial {best.number} of {len(trials)}",
        f"version {report.code_version()}",
        f"tuned on {study.place}, robots {report.seeds(study.file.robots)}: "
        f"score {trials[0].value:.3f} -> {best.value:.3f}",
    ]
    if result.comparisons:
        unseen = report.seeds(study.file.unseen)
        provenance.append(f"medians over unseen robots {unseen}, before -> after:")
        provenance += [f"  {report.unseen_line(study, each)}" for each in result.comparisons]
    else:
        provenance.append("not confirmed on unseen robots")
    winner = study.start.replace(**best.params)
    report.write_preset(out / "best.yaml", winner, list(study.file.parameters), provenance)
    shares = report.importance(kept.trials)
    text = [*provenance, "", *report.winner_lines(study, trials[0], best, shares)]
    text += ["", *report.finals_lines(study, result.candidates)]
    for comparison in result.comparisons:
        text += ["", *report.comparison_table(study, comparison)]
    failed = [t for t in trials if t.user_attrs["error"] is not None]
    text += [f"trial {t.number} failed: {t.user_attrs['error']}" for t in failed]
    (out / "report.txt").write_text("\n".join(text) + "\n", encoding="utf-8")
    title = f"{study.name}, {about['method']}, seed {about['seed']}"
    report.write_page(out / "report.html", title, kept.trials, text)
    say("\n".join(text))
    say(f"\nbest.yaml, report.txt and report.html in {out}")
