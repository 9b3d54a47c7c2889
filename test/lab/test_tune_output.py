"""What a finished study leaves: a preset with its provenance, figures, and an honest report."""

from pathlib import Path

import pytest
import yaml

pytest.importorskip("mujoco")
pytest.importorskip("optuna")
pytest.importorskip("sklearn")
pytest.importorskip("plotly")
pytest.importorskip("matplotlib")

import itertools

import optuna
from optuna.distributions import FloatDistribution
from optuna.trial import FrozenTrial, create_trial
from test_tune_study import GOOD

from gait_lab.cli import EXIT_USAGE, main
from gait_lab.tune import guide
from gait_lab.tune.confirm import Comparison, candidates, rows
from gait_lab.tune.guide import sample, step_duration
from gait_lab.tune.protocols import Measures
from gait_lab.tune.report import importance, seeds, write_preset
from gait_lab.tune.run import TuneOptions, run
from gait_lab.tune.study import Place, parse_study
from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import walk as walk_task
from sim_bridge.trials.trace import LEFT, RIGHT

PNG = b"\x89PNG"


def test_a_study_from_its_file_to_a_preset(tmp_path: Path) -> None:
    file, out, said = tmp_path / "tiny.yaml", tmp_path / "out", []
    file.write_text(yaml.safe_dump(
        {**GOOD, "trials": 5, "finals": {"candidates": 2, "robots": [1]}}
    ), encoding="utf-8")  # fmt: skip
    options = TuneOptions(str(file), method="cma", workers=1, out=out, seed=2)
    result = run(options, said.append)
    assert result is not None
    assert result.best is result.candidates[0].trial
    best = load_preset(out / "best.yaml")
    for name, value in result.best.params.items():
        assert getattr(best, name) == pytest.approx(value, abs=1e-6)
    assert best.step_forward_max > result.study.start.step_forward_max
    before, after = result.comparisons[0].before, result.comparisons[0].after
    assert after[0].values["distance"] > before[0].values["distance"] > 0.0
    text = (out / "best.yaml").read_text(encoding="utf-8")
    for part in ("study tiny", "method cma, seed 2", "version ", "mujoco/reference",
                 "unseen robots 5", "speed"):  # fmt: skip
        assert part in text
    report = (out / "report.txt").read_text(encoding="utf-8").strip()
    assert report in "\n".join(said)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "swing_lift" in page
    assert page.count("Plotly.newPlot") == 3
    with pytest.raises(NaoGaitError, match="--resume"):
        run(options, said.append)


SPACE = {"step_forward_max": FloatDistribution(0.02, 0.08),
         "swing_lift": FloatDistribution(0.01, 0.03)}  # fmt: skip


def trial(x: float, y: float, score: float, error: str | None = None) -> FrozenTrial:
    """A trial at shares of the ranges."""
    values = {name: d.low + at * (d.high - d.low)
              for (name, d), at in zip(SPACE.items(), (x, y), strict=True)}  # fmt: skip
    attributes = {"measures": [], "error": error}
    return create_trial(
        params=values, distributions=dict(SPACE), value=score, user_attrs=attributes
    )


def test_finals_are_between_trials_that_differ() -> None:
    study = parse_study({**GOOD, "finals": {"candidates": 2, "robots": [1]}})
    best, twin, other, failed = (
        trial(0.5, 0.5, 3.0), trial(0.51, 0.5, 2.9), trial(0.9, 0.1, 2.0),
        trial(0.1, 0.1, 2.5, "lost"),
    )  # fmt: skip
    assert candidates(study, [failed, other, twin, best]) == [best, other]


def test_importance_finds_the_parameter_that_matters() -> None:
    spread = [((i * 7 % 40) / 40, (i * 11 % 37) / 37) for i in range(40)]
    study = optuna.create_study(direction="maximize")
    study.add_trials([trial(x, y, 5.0 * y**2) for x, y in spread])
    found = importance(study)
    assert found["swing_lift"] > 0.9
    assert sum(found.values()) == pytest.approx(1.0)
    flat = optuna.create_study(direction="maximize")
    flat.add_trials([trial(x, y, 1.0) for x, y in spread])
    assert importance(flat) == {}


def test_a_robot_that_falls_shows_in_the_table() -> None:
    values = {name: 1.0 for name in ("distance", "speed", "steps", "drift", "flight", "slip")}
    good = Measures(5, values, fell=False)
    fallen = Measures(6, {**values, "speed": 0.0, "slip": 2.0}, fell=True, excess=0.5)
    table = {
        row.name: row
        for row in rows(
            parse_study(GOOD), Comparison(Place("mujoco", "reference"), (good, good, good),
                                          (good, good, fallen)))
    }  # fmt: skip
    assert table["fell"].before[0] == 0.0
    assert table["fell"].after[0] == 1.0
    assert table["over the limits"].after[0] == 1.0
    assert table["speed"].after == (0.0, 1.0)
    assert table["slip"].after == (2.0, 1.0)  # here the larger is the worse
    assert table["score"].after[0] == pytest.approx(1.0 - 3.0 - 0.5)


def test_a_wider_pendulum_steps_faster(tmp_path: Path) -> None:
    slow, fast = (sample(("pendulum_width", width, 0, 0.1)) for width in (0.025, 0.04))
    assert not slow.metrics.fell
    assert not fast.metrics.fell
    assert slow.step_duration > 1.2 * fast.step_duration
    guide.draw("pendulum_width", [slow, fast], tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(PNG)


def test_step_duration_is_the_time_between_support_changes() -> None:
    task = walk_task("forward", x=0.1, axis="x", window=2.0)
    trace = rollout(RolloutSpec(task, engine="mujoco", keep_trace=True)).trace
    assert trace is not None
    window = trace.between(task.start, task.end)
    steps = window.time[-1] / step_duration(window)
    support = [s for s in window.support if s in (LEFT, RIGHT)]
    changes = sum(a != b for a, b in itertools.pairwise(support))
    assert steps == pytest.approx(changes, abs=1.5)


def test_the_guide_refuses_what_it_does_not_sweep(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["write", "guide", "beauty"]) == EXIT_USAGE
    assert capsys.readouterr().err.count("\n") == 1


def test_seeds_are_shown_as_a_range() -> None:
    assert [seeds(robots) for robots in ((3, 4, 5), (0, 2), (7,))] == ["3..5", "0 2", "7"]


def test_the_winner_is_a_preset_that_every_tool_takes(tmp_path: Path) -> None:
    winner = GaitParameters(swing_lift=0.0231234, feedback=False)
    path = tmp_path / "best.yaml"
    write_preset(path, winner, ["swing_lift"], ["Tuned: a: b"])
    assert load_preset(path) == winner
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# Tuned: a: b\n")
    # the defaults may change later, this file does not
    assert all(f"{name}:" in text for name in winner.as_dict())
