"""What a finished study leaves: a preset with its provenance, figures, and an honest report."""

from pathlib import Path

import pytest
import yaml

pytest.importorskip("mujoco")
pytest.importorskip("cma")
pytest.importorskip("sklearn")
pytest.importorskip("matplotlib")

import itertools

from test_tune_study import GOOD

from gait_lab.tune import guide
from gait_lab.tune.confirm import Comparison, candidates, rows
from gait_lab.tune.evaluation import Trial
from gait_lab.tune.guide import Sweep, SweepSetup, run_sweep, step_duration
from gait_lab.tune.protocols import Measures
from gait_lab.tune.report import importance, write_preset
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
    result = run(
        TuneOptions(str(file), method="cma", workers=1, out=out, seed=2), said.append
    )
    best = load_preset(out / "best.yaml")
    for name, value in result.study.values_at(result.best.point).items():
        assert getattr(best, name) == pytest.approx(value, abs=1e-6)
    assert result.best is result.candidates[0].trial
    text = (out / "best.yaml").read_text(encoding="utf-8")
    for part in ("study tiny", "method cma, seed 2", "version ", "mujoco/reference",
                 "unseen robots 5", "speed"):  # fmt: skip
        assert part in text
    assert (out / "report.txt").read_text(encoding="utf-8").strip() in "\n".join(said)
    for figure in ("convergence", "importance", "pairs"):
        assert (out / f"{figure}.png").read_bytes().startswith(PNG)
    with pytest.raises(NaoGaitError, match="--resume"):
        run(TuneOptions(str(file), method="cma", workers=1, out=out, seed=2), said.append)


def trial(number: int, point: tuple[float, float], score: float) -> Trial:
    return Trial(number, point, score, (), 0.0)


def test_finals_are_between_trials_that_differ() -> None:
    study = parse_study({**GOOD, "finals": {"candidates": 2, "robots": [1]}})
    best, twin, other, failed = (
        trial(0, (0.5, 0.5), 3.0), trial(1, (0.51, 0.5), 2.9), trial(2, (0.9, 0.1), 2.0),
        Trial(3, (0.1, 0.1), 2.5, (), 0.0, "lost"),
    )  # fmt: skip
    assert candidates(study, [failed, other, twin, best]) == [best, other]


def test_importance_finds_the_parameter_that_matters() -> None:
    study = parse_study(GOOD)
    spread = [((i * 7 % 40) / 40, (i * 11 % 37) / 37) for i in range(40)]
    found = importance(study, [trial(i, p, 5.0 * p[1] ** 2) for i, p in enumerate(spread)])
    assert found.shares["swing_lift"] > 0.9
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert found.explained > 0.8
    nothing = importance(study, [trial(i, p, 1.0) for i, p in enumerate(spread)])
    assert set(nothing.shares.values()) == {0.0}


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
    setup = SweepSetup(GaitParameters(), 0.1, (0,), window=2.0)
    sweep = Sweep("pendulum_width", (0.025, 0.04))
    slow, fast = run_sweep(sweep, setup, 1, show=False)
    assert not slow.fell
    assert not fast.fell
    assert slow.step_duration > 1.2 * fast.step_duration
    figure = guide.draw(sweep, [slow, fast], setup, tmp_path / "figure.png")
    assert figure.read_bytes().startswith(PNG)
    assert "cm/s" in guide.text(sweep, [slow, fast])


def test_step_duration_is_the_time_between_support_changes() -> None:
    task = walk_task("forward", x=0.1, axis="x", window=2.0)
    trace = rollout(RolloutSpec(task, engine="mujoco", keep_trace=True)).trace
    assert trace is not None
    window = trace.between(task.start, task.end)
    steps = window.time[-1] / step_duration(window)
    support = [s for s in window.support if s in (LEFT, RIGHT)]
    changes = sum(a != b for a, b in itertools.pairwise(support))
    assert steps == pytest.approx(changes, abs=1.5)


def test_the_guide_refuses_what_is_no_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    assert guide.main(["beauty"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(NaoGaitError):
        Sweep("swing_lift", (0.5,))


def test_the_winner_is_a_preset_that_every_tool_takes(tmp_path: Path) -> None:
    winner = GaitParameters(swing_lift=0.0231234, feedback=False)
    path = write_preset(tmp_path / "best.yaml", winner, {"swing_lift": 0.0231234}, ["Tuned: a: b"])
    assert load_preset(path) == winner
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# Tuned: a: b\n")
    # the defaults may change later, this file does not
    assert all(f"{name}:" in text for name in winner.as_dict())
