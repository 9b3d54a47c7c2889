"""The world model on rendered images: a robot sees where it is."""

import pytest

from gait_lab.soccer.field_walks import WalkSpec

pytest.importorskip("cv2")
pytest.importorskip("mujoco")


@pytest.mark.slow
def test_a_robot_that_sees_a_rendered_pitch_knows_where_it_is():
    from gait_lab.bench.suites.world import pose_scores
    from gait_lab.soccer.world_trial import run_rendered

    trace = run_rendered(WalkSpec(seed=1, seconds=1.0))
    score = pose_scores([trace])
    assert len(trace.time) > 60
    assert score["pose_error_median"][1] < 8.0
    assert score["heading_error_median"][1] < 4.0
    assert score["valid_share"][1] > 80.0


@pytest.mark.slow
def test_a_robot_that_sees_a_rendered_ball_brings_it_into_the_goal():
    from gait_lab.bench.suites.solo import SoloSpec, play_solo

    start, ball = (1.0, 0.1, 0.0), (1.6, 0.1)
    result = play_solo(SoloSpec(seed=1, start=start, ball=ball, limit=30.0, rendered=True))
    assert result.goal is not None, result.path
