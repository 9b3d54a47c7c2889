"""The blend into the stand: no jump, its whole duration, and an early end at the target."""

import numpy as np
import pytest

from nao_lipm_gait.whole_body.stand_blend import REACHED, SET_DOWN_TIME, STAND_TIME, StandBlend

DT, DURATION = 0.01, STAND_TIME
STAND = np.array((0.3, -0.2, 0.0))


def ticks(blend: StandBlend) -> list[np.ndarray]:
    way = []
    while blend.active:
        way.append(blend.apply(STAND, DT))
    return way


def test_it_lasts_its_duration_and_comes_to_rest_in_the_stand() -> None:
    blend = StandBlend()
    blend.begin(STAND + 0.4)
    way = np.array(ticks(blend))
    assert len(way) == round(DURATION / DT)
    np.testing.assert_allclose(way[-1], STAND, atol=1e-12)
    speed = np.abs(np.diff(way[:, 0])) / DT
    assert speed[0] < 0.1 * speed.max()
    assert speed[-1] < 0.1 * speed.max()
    assert speed.max() == pytest.approx(1.5 * 0.4 / DURATION, rel=1e-2)


def test_watched_joints_at_the_target_end_it_at_once_and_others_do_not() -> None:
    there = StandBlend()
    there.begin(STAND + np.array((0.5 * REACHED, 0.0, 0.7)), watched=(0, 1))
    assert len(ticks(there)) == 1
    elsewhere = StandBlend()
    elsewhere.begin(STAND + np.array((2.0 * REACHED, 0.0, 0.0)), watched=(0, 1))
    assert len(ticks(elsewhere)) == round(DURATION / DT)


def test_without_watched_joints_a_robot_in_its_stand_gets_time_to_settle() -> None:
    blend = StandBlend()
    blend.begin(STAND)
    assert len(ticks(blend)) == round(DURATION / DT)


def test_a_new_blend_forgets_the_watched_joints_of_the_last_one() -> None:
    blend = StandBlend()
    blend.begin(STAND, watched=(0,))
    blend.begin(STAND)
    assert len(ticks(blend)) == round(DURATION / DT)


def test_feet_that_are_set_down_are_there_sooner() -> None:
    blend = StandBlend()
    blend.begin(STAND + 0.4, time=SET_DOWN_TIME)
    assert len(ticks(blend)) == round(SET_DOWN_TIME / DT)
    blend.begin(STAND + 0.4)
    assert len(ticks(blend)) == round(DURATION / DT)
