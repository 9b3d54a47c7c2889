"""The suite `paper`: what is beside what, what counts, and the paper's figures."""

from dataclasses import replace
from pathlib import Path

import pytest
from scores import metrics, score, values

from gait_lab.bench.comparison import Outcome
from gait_lab.bench.paper_figures import FIGURES, paper_figures
from gait_lab.bench.pushes import Cell
from gait_lab.bench.score import FallDetection, Score
from gait_lab.bench.suite import plan
from gait_lab.bench.suites.paper import Options, contenders, outcome_rows
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task


def outcome(*scores: Score, name: str = "paper") -> Outcome:
    return Outcome(name, scores, {("left", 1.0): Cell(survived=3, pushed=4)}, FallDetection())


def test_each_quantity_of_the_paper_is_beside_its_published_value() -> None:
    walked = {
        "forward": metrics(speed_x=0.3, com_error_y_measured=0.004, com_error_y=0.003),
        "back": metrics(speed_x=-0.2),
        "side": metrics(speed_y=0.11),
        "turn": metrics(turn_rate=1.5),
        "spot": metrics(speed_x=0.006, speed_y=-0.008, com_error_y_measured=0.002),
    }
    found = outcome(*(score(task, each) for task, each in walked.items()))
    rows = {row.metric: row for row in outcome_rows(found, "")}
    published = {"forward": 31.0, "back": 22.0, "side": 12.0, "turn": 92.0}
    for task, speed in published.items():
        assert rows[f"paper_{task}_median"].paper == speed
    assert rows["paper_forward_median"].value == pytest.approx(30.0)
    assert rows["paper_com_error_full"].value == pytest.approx(4.0)
    assert rows["paper_com_error_full"].paper == 7.76
    assert rows["paper_com_error_true_full"].value == pytest.approx(3.0)
    assert rows["paper_com_error_spot"].paper == 4.26
    assert rows["paper_spot_drift_worst"].value == pytest.approx(1.0)
    assert rows["paper_push_left_1_survival"].value == 75.0


def test_a_fall_leaves_the_speed_of_the_upright_but_not_the_result() -> None:
    walked = score("forward", metrics(speed_x=0.3), metrics(fell=True, fall_time=4.0))
    rows = values(outcome_rows(outcome(walked), "drawn_"))
    assert rows["paper_drawn_forward_median"] is None
    assert rows["paper_drawn_forward_median_of_upright"] == pytest.approx(30.0)
    assert rows["paper_drawn_forward_upright"] == 1


def test_a_robot_whose_calibration_failed_walks_without_and_does_not_count() -> None:
    pytest.importorskip("mujoco")
    task = find_task("spot").measured(0.1, 0.2)
    weak = (("motor.torque_fraction", 0.05),)  # it collapses in the stand
    spec = RolloutSpec(task, engine="mujoco", plant_options=weak, calibrated=True)
    result = rollout(spec)
    assert result.calibration_failed
    assert "not calibrated" in Score(task, True, (result,)).mark
    assert not rollout(replace(spec, plant_options=(), calibrated=False)).calibration_failed


def test_the_open_loop_differs_from_the_preset_in_the_feedback_alone() -> None:
    paper, open_loop, default = contenders(Options())
    assert paper.parameters == load_preset("paper")
    assert open_loop.parameters == paper.parameters.replace(feedback=False)
    assert default.parameters == Options().parameters
    assert [each.name for each in contenders(Options(open_loop="off"))] == ["paper", "default"]


@pytest.mark.parametrize(
    ("asked", "field"),
    [({"urdf": "bruno"}, "robot"), ({"tasks": ("forward=31", "forward=25")}, "task")],
)
def test_what_cannot_be_compared_is_refused(asked: dict[str, object], field: str) -> None:
    with pytest.raises(NaoGaitError) as refused:
        plan("paper", asked)
    assert refused.value.field == field


def test_the_papers_figures_are_drawn(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    options = Options(engine="mujoco", seed=2, parameters=load_preset("paper"), show=False)
    files = paper_figures(options, tmp_path / "figures")
    assert [file.name for file in files] == [f"paper_figure_{number}.png" for number in FIGURES]
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in files)
