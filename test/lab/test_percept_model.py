"""Percepts without images: the errors that were asked for, and the walks under them."""

import math

import attrs
import numpy as np
import pytest

from gait_lab.bench.suites.world import pose_scores, right_again
from gait_lab.soccer.ball_course import BallCourse
from gait_lab.soccer.field_walks import WalkSamples
from gait_lab.soccer.percept_model import OtherRobot, PerceptModel
from gait_lab.soccer.world_trial import (
    Gap,
    WorldTrialSpec,
    run_trial,
    spliced,
    turned_after,
)
from gait_lab.vision.percept_errors import load_percept_errors
from nao_soccer.vision.percepts import Kind
from pitch_image import camera
from robot_core.field import Field, Goals
from robot_core.geometry import compose, relative
from sim_bridge.ball import ROLLING_SLOWDOWN

ERRORS = load_percept_errors()
FIELD, GOALS = Field(), Goals()
VIEW = camera(0.0, 0.0, 0.0, tilt=0.25)
"""A camera in base_footprint."""
HERE = (2.2, 0.3, 0.0)


def test_without_errors_percepts_are_where_the_field_is():
    model = PerceptModel(ERRORS, FIELD, GOALS, 0, scale=0.0)
    ball = (3.4, 0.3)
    percepts = [model.see(stamp, VIEW, HERE, ball) for stamp in range(20)]
    x, y, _ = relative((*ball, 0.0), HERE)
    for each in percepts:
        assert each.ball.position == pytest.approx((x, y))
    posts = {(4.5, 0.8), (4.5, -0.8)}
    for each in percepts:
        for post in each.of(Kind.GOAL_POST):
            place = compose(HERE, (*post.position, 0.0))
            assert min(math.dist(place[:2], known) for known in posts) < 1e-9
    crossing = next(c for each in percepts for c in each.of(Kind.CROSSING_T))
    place = compose(HERE, (*crossing.position, crossing.yaw))
    known = min(FIELD.crossings(), key=lambda c: math.dist((c.x, c.y), place[:2]))
    assert math.dist((known.x, known.y), place[:2]) < 1e-9
    assert math.cos(known.heading - place[2]) > 0.999


def test_the_errors_have_the_deviations_that_were_measured():
    quiet = attrs.evolve(
        ERRORS, **{name: attrs.evolve(getattr(ERRORS, name), robot=0.0, image=0.0)
                   for name in ("tilt", "pan", "shift")},
    )  # fmt: skip
    model = PerceptModel(quiet, FIELD, GOALS, 1)
    seen = [model.see(stamp, VIEW, HERE, (3.7, 0.3)).ball for stamp in range(800)]
    places = np.array([ball.position for ball in seen if ball is not None])
    assert len(places) / 800 == pytest.approx(ERRORS.recall("ball", 1.5), abs=0.03)
    depression = np.arctan2(ERRORS.camera_height, np.hypot(*places.T))
    bearing = np.arctan2(places[:, 1], places[:, 0])
    assert depression.std() == pytest.approx(ERRORS.kinds["ball"].depression, rel=0.12)
    assert bearing.std() == pytest.approx(ERRORS.kinds["ball"].bearing, rel=0.12)


def test_nothing_is_seen_outside_the_image_or_behind_a_robot():
    model = PerceptModel(ERRORS, FIELD, GOALS, 2, scale=0.0)
    assert model.see(0, VIEW, HERE, (0.5, 0.3)).ball is None
    ball = (4.2, 0.3)
    robot = OtherRobot(Kind.ROBOT_BLUE, (3.2, 0.3))
    assert model.see(0, VIEW, HERE, ball).ball is not None
    hidden = model.see(0, VIEW, HERE, ball, [robot])
    assert hidden.ball is None
    assert [each.kind for each in hidden.objects].count(Kind.ROBOT_BLUE) <= 1


@pytest.mark.parametrize(
    ("distance", "tilt", "seen"),
    [(0.3, 0.5, True), (0.7, 0.35, True), (0.3, 1.2, False), (1.0, 0.9, False)],
)
def test_a_near_robot_is_seen_by_its_torso_not_by_its_feet(distance, tilt, seen):
    """Where the camera looks at the ground before the robot, its feet may be in the image."""
    model = PerceptModel(ERRORS, FIELD, GOALS, 4, scale=0.0)
    view = camera(0.0, 0.0, 0.0, tilt=tilt)
    robot = OtherRobot(Kind.ROBOT_BLUE, (HERE[0] + distance, HERE[1]))
    images = [model.see(stamp, view, HERE, None, [robot]) for stamp in range(20)]
    found = [each.of(Kind.ROBOT_BLUE) for each in images]
    assert any(found) == seen
    for each in found:
        for percept in each:
            error = math.dist(percept.position, (distance, 0.0))
            assert error < 2.0 * math.sqrt(percept.covariance[0])


@pytest.mark.parametrize(("distance", "seen"), [(1.2, True), (2.5, False)])
def test_a_robot_that_lies_is_seen_up_to_a_distance(distance, seen):
    model = PerceptModel(ERRORS, FIELD, GOALS, 5, scale=0.0)
    robot = OtherRobot(Kind.ROBOT_RED, (HERE[0] + distance, HERE[1]), lies=True)
    images = [model.see(stamp, VIEW, HERE, None, [robot]) for stamp in range(20)]
    found = [percept.position for each in images for percept in each.of(Kind.ROBOT_RED)]
    assert bool(found) == seen
    assert all(place == pytest.approx((distance, 0.0)) for place in found)


def test_a_ball_course_follows_friction():
    course = BallCourse((50.0, 50.0), 0)
    truths = [course.at(0.02 * tick, (0.0, 0.0, 0.0)) for tick in range(350)]
    speeds = np.array([math.hypot(*truth.velocity) for truth in truths])
    assert (speeds[:140] == 0.0).all()
    start = int(np.argmax(speeds > 0.0))
    slower = (speeds[start] - speeds[start + 30]) / (30 * 0.02)
    assert slower == pytest.approx(ROLLING_SLOWDOWN, rel=1e-6)
    way = math.dist(truths[start].position, truths[start + 30].position)
    assert way == pytest.approx(0.6 * 0.5 * (speeds[start] + speeds[start + 30]))


def circle(seconds: float, start=(-1.0, -0.4, 0.0), speed: float = 0.15) -> WalkSamples:
    """A robot that walks a circle; odometry is exact."""
    count = round(seconds * 50)
    pose, poses = start, []
    for _ in range(count):
        pose = compose(pose, (speed * 0.02, 0.0, 0.3 * 0.02))
        poses.append(pose)
    truth = np.array(poses)
    odometry = np.array([relative(tuple(each), start) for each in poses])
    torso = np.tile((0.0, 0.0, 0.33, 0.0, 0.0, 0.0), (count, 1))
    stamp = 20_000_000 * np.arange(1, count + 1)
    return WalkSamples(stamp, odometry, torso, truth)


def test_a_trial_follows_the_robot():
    trace = run_trial(WorldTrialSpec(seed=1), circle(8.0))
    score = pose_scores([trace])
    assert score["pose_error_median"][1] < 8.0
    assert score["heading_error_median"][1] < 4.0
    assert score["valid_share"][1] > 80.0
    assert score["valid_wrong_share"][1] == 0.0
    assert score["wrong_half"][1] == 0


def test_the_age_of_a_ball_is_that_in_the_image():
    early, late = (
        run_trial(WorldTrialSpec(seed=1, delay=delay), circle(1.0)) for delay in (0.0, 0.3)
    )
    assert late.ball_age[0] == pytest.approx(early.ball_age[0])
    assert late.time[0] - early.time[0] == pytest.approx(0.3)


def test_a_robot_that_is_carried_stands_elsewhere_and_odometry_does_not_know():
    walk, other = circle(6.0), circle(10.0, (1.0, 0.5, 2.0))
    joined = spliced(walk, other, 5.0, 1.0)
    steps = np.diff(joined.odometry, axis=0)
    assert np.abs(steps[:, :2]).max() < 0.01
    jumps = np.hypot(*np.diff(joined.truth[:, :2], axis=0).T)
    assert (jumps > 0.1).sum() == 1
    assert joined.stamp[-1] - joined.stamp[0] == 20_000_000 * (len(joined.stamp) - 1)


def test_after_a_fall_the_trial_is_right_again():
    walk = turned_after(circle(14.0, (-1.0, -0.4, 0.5), 0.05), 4.0, 1.0, 0.8)
    assert walk.truth[-1, 2] - circle(14.0, (-1.0, -0.4, 0.5), 0.05).truth[-1, 2] == pytest.approx(
        0.8
    )
    gap = Gap(4.02, 5.02, fall=True)
    trace = run_trial(WorldTrialSpec(seed=3, gap=gap), walk)
    assert right_again(trace, 5.0) < 8.0
    lying = (trace.time > 4.3) & (trace.time < 5.0)
    assert not trace.valid[lying].any()
