"""The examples, each in its short form: what they print is what the robot did."""

import importlib.util
import json
import math
import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from nao_lipm_gait import NaoGaitError
from sim_bridge.trials.rollout import RolloutSpec
from sim_bridge.trials.tasks import walk

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))

pytestmark = pytest.mark.usefixtures("mujoco_only")


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_drive_goes_forward_left_and_turns() -> None:
    stand, forward, left, turn, end = load("drive").main(["--quick"])
    assert math.hypot(*stand[:2]) < 0.03
    assert forward[0] > 0.25
    assert left[1] - forward[1] > 0.1
    assert turn[2] - left[2] > 1.0
    assert math.dist(turn[:2], end[:2]) < 0.05


def test_push_finds_the_limit() -> None:
    assert load("push").main(["--quick"]) == {1.0: True, 20.0: False}


def test_own_observer_walks_and_differs_from_the_kalman_filter() -> None:
    found = load("own_observer").main(["--quick"])
    assert len(set(found.values())) == 2
    for way, error, fell in found.values():
        assert way > 0.5
        assert 0.0 < error < 0.01
        assert not fell


def test_own_plants_walk_and_differ(tmp_path: Path) -> None:
    carpet = tmp_path / "carpet.yaml"
    carpet.write_text("base: reference\nterrain: {kind: carpet}\n")
    found = load("own_plant").main(["--quick", "--plant", str(carpet)])
    assert len(set(found.values())) == len(found) == 4
    assert all(way > 0.25 and not fell for way, fell in found.values())


def test_estimate_finds_the_end_of_the_walk_from_a_file(tmp_path: Path) -> None:
    log = tmp_path / "walk.npz"
    estimate = load("estimate")
    found = estimate.main(["--quick", str(log)])
    assert found["place_end"][0] < 5.0
    assert found["yaw_end"][0] < 5.0
    assert log.exists()
    assert estimate.main(["--quick", str(log)]) == found


def test_the_kicked_ball_rolls_and_the_robot_stands() -> None:
    kick = load("kick")
    way, stands = kick.main(["--quick"])
    assert way > 0.5
    assert stands
    with pytest.raises(NaoGaitError, match="a motion that kicks"):
        kick.main(["--kick", "get_up_front"])


def test_the_ball_moves_in_a_match() -> None:
    score, way = load("play_match").main(["--quick"])
    assert way > 0.5
    assert set(score) == {"red", "blue"}


def test_tuning_keeps_the_best_of_its_trials() -> None:
    pytest.importorskip("optuna", reason="the extra `tune` is not installed")
    study = load("tune_three").main(["--quick"])
    assert len(study.trials) == 3
    assert study.best_value == max(trial.value for trial in study.trials)
    assert study.best_value > 0.15, "m/s: it walked"


def test_a_bag_is_plotted(tmp_path: Path) -> None:
    pytest.importorskip("plotly", reason="the extra `lab` is not installed")
    pytest.importorskip("rosbags", reason="the extra `lab` is not installed")
    from walk_bag import write_walk

    task = walk("forward", x=0.2, window=1.0).measured(0.5, 3.0)
    bag = write_walk(tmp_path / "bag", RolloutSpec(engine="mujoco", task=task)).bag
    page = tmp_path / "walk.html"
    trace = load("plot_bag").main([str(bag), "--out", str(page), "--quick"])
    assert trace.time[-1] == pytest.approx(2.0, abs=0.03)
    assert trace.torso_position[0, 2] > 0.2
    text = page.read_text(encoding="utf-8")
    assert all(name in text for name in ("torso height", "left sole", "right sole"))


def test_a_residual_is_not_worse_than_the_gait_alone() -> None:
    pytest.importorskip("gymnasium", reason="the extra `gym` is not installed")
    alone, best = load("residual").main(["--quick"])
    assert alone > 0.3
    assert best >= alone


def test_the_cells_of_the_notebook_run_and_hold_no_outputs(capsys: pytest.CaptureFixture) -> None:
    matplotlib = pytest.importorskip("matplotlib", reason="the extra `lab` is not installed")
    matplotlib.use("Agg")
    cells = json.loads((EXAMPLES / "first_walk.ipynb").read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code)
    names: dict = {}
    for cell in code:
        exec("".join(cell["source"]), names)
    assert names["true"][-1, 0] > 0.5
    assert names["estimated"][-1, 0] == pytest.approx(names["true"][-1, 0], abs=0.15)
    assert "walked" in capsys.readouterr().out


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_is_short_and_has_a_short_form(
    script: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    assert len(script.read_text(encoding="utf-8").splitlines()) <= 70
    monkeypatch.setattr(sys, "argv", [str(script), "--help"])
    try:
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(str(script), run_name="__main__")
    except ModuleNotFoundError as error:
        pytest.skip(str(error))
    assert ended.value.code == 0
    assert "--quick" in capsys.readouterr().out


def test_there_are_ten_examples_and_the_page_names_each() -> None:
    page = (EXAMPLES.parent / "docs" / "python.md").read_text(encoding="utf-8")
    assert len(SCRIPTS) == 10
    for file in (*SCRIPTS, EXAMPLES / "first_walk.ipynb"):
        assert f"../examples/{file.name}" in page


@pytest.mark.parametrize(
    ("command", "field"),
    [("drive.py --robot hans", "robot"), ("own_plant.py --quick --plant moon", "plant"),
     ("kick.py --kick dance", "motion"), ("play_match.py --scene moon", "scene"),
     ("plot_bag.py nowhere", "bag")],
)  # fmt: skip
def test_a_wrong_argument_ends_in_one_line(command: str, field: str) -> None:
    script, *options = command.split()
    done = subprocess.run(
        [sys.executable, EXAMPLES / script, *options], capture_output=True, text=True
    )
    if "ModuleNotFoundError" in done.stderr:
        pytest.skip(done.stderr.splitlines()[-1])
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"{field}: got ")
