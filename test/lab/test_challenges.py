"""Technical challenges: the rules, without physics, and what the engines say of contacts."""

import itertools
import math

import pytest

from gait_lab.soccer.challenge_rules import (
    AWAY,
    KICK_TIME,
    PENALTY,
    QUIET,
    SIDES,
    ControlReferee,
    Course,
    KickReferee,
    Past,
    WalkReferee,
    Way,
)
from robot_core.field import Field
from robot_core.types import Point2
from sim_bridge.engines.backend import BALL
from sim_bridge.plant import load_plant
from sim_bridge.scene import load_scene
from sim_bridge.world import World

COURSE = Course.on(Field())
RADIUS = 0.05
LINE = 3.0 - 0.025
"""[m] y of the near edge of the target touchline."""


def walk(referee: WalkReferee, *places: tuple[float, float], touches: bool = False) -> None:
    """A robot whose foot is 0.1 m ahead of its middle, one second from place to place."""
    for time, (x, y) in enumerate(places):
        referee.update(float(time), (x, y), [(x, y + 0.1), (x, y)], touches=touches)


def test_the_course_is_that_of_the_published_figure() -> None:
    assert COURSE.start[:2] == pytest.approx((3.2, -3.59))
    expected = ((2.85, -2.0), (3.9, -1.1), (3.2, 0.0), (3.9, 1.1))
    for place, published in zip(COURSE.obstacles, expected, strict=True):
        assert place == pytest.approx(published)
    lengths = [math.dist((COURSE.goal_area, 0.0), target) for target in COURSE.targets]
    assert lengths == pytest.approx([3.9, 7.1, math.hypot(8.4, 3.0)])


def test_the_way_keeps_its_gap_on_the_right_side_of_each_obstacle() -> None:
    past = [Past(place, 0.4 * side) for place, side in zip(COURSE.obstacles, SIDES, strict=True)]
    way = COURSE.way(*past)
    points: list[Point2] = []
    for (x0, y0), (x1, y1) in itertools.pairwise(way.points):
        points += [(x0 + k * (x1 - x0) / 50, y0 + k * (y1 - y0) / 50) for k in range(50)]
    for (x, y), side in zip(COURSE.obstacles, SIDES, strict=True):
        nearest = min(points, key=lambda point: math.dist(point, (x, y)))
        assert math.dist(nearest, (x, y)) == pytest.approx(0.4, abs=0.01)
        beside = min(points, key=lambda point: (abs(point[1] - y), math.dist(point, (x, y))))
        assert (beside[0] - x) * side > 0.0


def test_the_way_ahead_begins_at_its_nearest_point() -> None:
    way = Way(((0.0, 0.0), (1.0, 0.0), (1.0, 2.0)))
    assert way.ahead((0.2, -0.3), 0.5) == pytest.approx((0.7, 0.0))
    assert way.ahead((0.8, 0.1), 0.5) == pytest.approx((1.0, 0.3))
    assert way.ahead((1.2, 1.9), 0.5) == (1.0, 2.0)


def test_a_walk_lasts_from_the_touch_of_one_line_to_that_of_the_other() -> None:
    referee = WalkReferee(COURSE, weaves=False)
    walk(referee, (3.2, -3.6), (3.2, -3.13), (3.2, -3.12), (3.2, 0.0), (3.2, LINE - 0.11))
    assert (referee.began, referee.ended, referee.seconds) == (2.0, None, None)
    referee.update(9.0, (3.2, LINE), [(3.2, LINE + 0.01)])
    assert referee.seconds == 7.0
    lifted = WalkReferee(COURSE, weaves=False)
    lifted.update(1.0, (3.2, LINE), [])  # no foot is on the floor
    assert lifted.began is None


def test_who_touches_an_obstacle_or_leaves_one_out_has_not_walked_around_it() -> None:
    by = [(x + 0.5 * side, y + 0.01) for (x, y), side in zip(COURSE.obstacles, SIDES, strict=True)]
    through = ((3.2, -3.0), *by, (3.2, 2.95))
    whole, touching, straight, free = (
        WalkReferee(COURSE, weaves=weaves) for weaves in (True, True, True, False)
    )
    walk(whole, *through)
    assert whole.seconds == len(through) - 1
    walk(touching, *through, touches=True)
    assert touching.seconds is None
    walk(straight, *((3.25, -3.0 + 0.5 * step) for step in range(13)))
    assert not straight.passed
    assert straight.seconds is None
    walk(free, *((3.25, -3.0 + 0.5 * step) for step in range(13)))
    assert free.seconds is not None


def control(referee: ControlReferee, time: float, gap: float, *, touches: bool = False) -> None:
    """A robot at the middle, with the ball ahead of it."""
    referee.update(time, (3.2, gap), (3.2, 0.0), [(3.2, 0.1), (3.2, -0.1)], touches=touches)


def test_each_time_that_the_ball_is_away_or_at_an_obstacle_costs_one_penalty() -> None:
    referee = ControlReferee(COURSE, RADIUS)
    control(referee, 0.0, AWAY - 0.01)
    assert referee.penalties == 0
    for tick in range(100):  # it stays away: one
        control(referee, 1.0 + 0.01 * tick, AWAY + 0.01)
    control(referee, 2.01, AWAY - 0.01)
    control(referee, 2.02, AWAY + 0.01)  # a sway of the robot is not another one
    assert referee.penalties == 1
    control(referee, 2.1 + 2.0 * QUIET, AWAY + 0.01)
    assert referee.penalties == 2
    control(referee, 5.0, 0.2, touches=True)
    control(referee, 5.1, 0.2, touches=True)
    assert (referee.away.count, referee.contacts.count) == (2, 1)


def test_ball_and_robot_have_to_be_wholly_beyond_the_line() -> None:
    beyond = COURSE.touchline + COURSE.line
    for ball, heel, ends in (
        (beyond + RADIUS + 0.01, beyond + 0.01, True),
        (beyond + RADIUS - 0.01, beyond + 0.01, False),
        (beyond + RADIUS + 0.01, beyond - 0.01, False),
    ):
        referee = ControlReferee(COURSE, RADIUS)
        control(referee, 3.0, AWAY + 0.1)
        feet = [(3.2, heel), (3.2, heel + 0.15)]
        referee.update(40.0, (3.2, ball), (3.2, heel), feet, touches=False)
        assert referee.seconds == (40.0 + PENALTY if ends else None)


def test_a_kick_is_measured_where_the_ball_rests() -> None:
    referee = KickReferee((-3.9, 0.0), (0.0, 0.0))
    referee.update(4.0, (-3.9, 0.01), 0.0, touches=True)  # aiming
    referee.update(6.0, (-3.7, 0.0), 1.5, touches=True)
    referee.update(6.1, (-3.5, 0.0), 1.5, touches=False)
    assert not referee.over
    referee.update(11.0, (-0.3, 0.4), 0.01, touches=False)
    assert referee.over
    assert referee.distance == pytest.approx(0.5)


def test_a_second_touch_or_a_late_kick_does_not_count() -> None:
    referee = KickReferee((-3.9, 0.0), (0.0, 0.0))
    referee.update(6.0, (-3.7, 0.0), 1.0, touches=False)
    referee.update(7.0, (-3.6, 0.0), 0.1, touches=True)
    assert referee.over
    assert referee.again
    assert referee.distance is None
    late = KickReferee((-3.9, 0.0), (0.0, 0.0))
    late.update(KICK_TIME + 0.1, (-3.9, 0.0), 0.0, touches=False)
    assert late.over
    assert late.distance is None


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_a_world_tells_what_touches(engine: str) -> None:
    pytest.importorskip(engine)
    scene = load_scene("pitch")
    one, other, *_ = scene.robots
    near = scene.replace(
        robots=(one.replace(pose=(-1.0, 0.0, 0.0)), other.replace(pose=(-1.0, 1.0, 0.0)))
    )
    with World.of_scene(near, load_plant("reference"), engine=engine) as world:
        world.put_ball(1.0, 0.0)
        world.step()
        assert world.touches == set()
        world.put_ball(-0.85, 1.05, (-1.5, 0.0))
        touches = set()
        for _ in range(10):
            world.step()
            touches |= world.touches
        assert touches == {(BALL, 1)}
