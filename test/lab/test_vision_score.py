"""What is due in an image, how percepts are scored, and the errors that are fitted to scores."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gait_lab.vision.expected import View
from gait_lab.vision.fit import fit
from gait_lab.vision.rendered_frames import FrameTruth
from gait_lab.vision.score import GATE, PoseDeviation, Score, Sighting, score_image
from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.vision.settings import VisionSettings
from pitch_image import camera
from robot_core.field import Goals
from robot_core.robot.camera import CameraPose, CameraView
from robot_core.types import Pose2

SETTINGS = VisionSettings(goals=Goals())
PLACE = (-3.0, 0.3)
NOTHING = np.empty((0, 2))


def truth(ball: tuple[float, float] | None = (-1.5, 0.3), **others: Pose2) -> FrameTruth:
    """A robot at `PLACE` that looks along x, as the field's frame has it."""
    view = camera(*PLACE, 0.0)
    place = None if ball is None else np.array((*ball, 0.05))
    return FrameTruth(view, (*PLACE, 0.0), place, others)


def seen(image: FrameTruth, *found: Percept, ball: Percept | None = None, turn: float = 0.0):
    """The score of percepts of an image, whose camera is thought to be turned left by an angle."""
    position, rotation = image.view.pose
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))) @ rotation
    pose = CameraPose(position - (*PLACE, 0.0), turned)
    geometry = ImageGeometry(CameraView(image.view.intrinsics, pose))
    percepts = Percepts(0, ball, found, NOTHING, np.empty((0, 3)), (), NOTHING)
    teams = {name: name.rstrip("0123456789") for name in image.others}
    return score_image(image, View(image, SETTINGS, teams), percepts, geometry)


def at(kind: Kind, x: float, y: float) -> Percept:
    """A percept at a place [m]."""
    return Percept(kind, (x, y), (1e-4, 0.0, 1e-4))


def test_ball_in_view_is_due_and_one_behind_a_robot_is_not():
    (ball,) = seen(truth()).due("ball")
    assert ball.position == pytest.approx((1.5, 0.0))
    assert not seen(truth(red2=(-2.2, 0.3, 0.0))).due("ball")
    assert not seen(truth(ball=(-4.0, 0.3))).due("ball")


@pytest.mark.parametrize("distance", [1.0, 2.5])
def test_a_percept_counts_within_the_gate_only(distance: float):
    image = truth(ball=(PLACE[0] + distance, PLACE[1]))
    gate = GATE[0] + GATE[1] * distance
    good = seen(image, ball=at(Kind.BALL, distance + 0.95 * gate, 0.0))
    assert (good.recall("ball"), good.false_per("ball", 1000)) == (100.0, 0.0)
    assert good.error_median("ball") == pytest.approx(95.0 * gate / distance)
    bad = seen(image, ball=at(Kind.BALL, distance + 1.05 * gate, 0.0))
    assert (bad.recall("ball"), bad.false_per("ball", 1000)) == (0.0, 1000.0)


def test_one_percept_is_not_two_objects_and_two_are_not_one():
    image = truth(None, red2=(-1.0, 0.3, 0.0))
    twice = seen(image, at(Kind.ROBOT_RED, 2.0, 0.0), at(Kind.ROBOT_RED, 2.1, 0.0))
    assert (twice.recall("robots"), twice.false_per("robots", 1)) == (100.0, 1.0)
    two = truth(None, red2=(-1.0, 0.0, 0.0), red3=(-1.0, 0.6, 0.0))
    assert seen(two, at(Kind.ROBOT_RED, 2.0, 0.0)).recall("robots") == 50.0


def test_another_team_is_missed_and_false():
    score = seen(truth(None, red2=(-1.0, 0.3, 0.0)), at(Kind.ROBOT_BLUE, 2.0, 0.0))
    assert (score.recall("robots"), score.false_per("robots", 1)) == (0.0, 1.0)


def test_error_of_the_pose_is_taken_out_of_that_of_a_percept():
    turn = 0.02
    place = 1.5 * math.cos(turn), 1.5 * math.sin(turn)
    score = seen(truth(), ball=at(Kind.BALL, *place), turn=turn)
    assert score.poses[0].pan == pytest.approx(turn)
    assert score.poses[0].tilt == pytest.approx(0.0, abs=1e-9)
    ball = fit([score], 0.1).kinds["ball"]
    assert ball.bearing < 1e-9


def test_fitted_errors_are_those_that_were_drawn():
    random = np.random.default_rng(1)
    height, runs = 0.45, []
    for _ in range(60):
        lasting = random.normal(0.0, 0.02)
        score = Score()
        for _ in range(40):
            pose = PoseDeviation(lasting + random.normal(0.0, 0.005), 0.0, 0.0, 0.0, height)
            distance = random.uniform(0.5, 3.0)
            depression = math.atan2(height, distance) + pose.tilt + random.normal(0.0, 0.003)
            bearing = random.normal(0.0, 0.01)
            reach = height / math.tan(max(depression, 0.02))
            place = reach * math.cos(bearing), reach * math.sin(bearing)
            found = Kind.BALL if random.uniform() < 0.8 else None
            sighting = Sighting(Kind.BALL, (distance, 0.0), True, True, found, place, pose)
            score.add(Score(images=1, sightings=[sighting], poses=[pose]))
        runs.append(score)
    errors = fit(runs, 0.1)
    assert errors.camera_height == pytest.approx(height)
    assert errors.tilt.robot == pytest.approx(0.02, rel=0.3)
    assert errors.tilt.image == pytest.approx(0.005, rel=0.1)
    assert errors.kinds["ball"].depression == pytest.approx(0.003, rel=0.1)
    assert errors.kinds["ball"].bearing == pytest.approx(0.01, rel=0.1)
    for distance in (0.75, 1.5, 2.5):
        assert errors.recall("ball", distance) == pytest.approx(0.8, abs=0.06)


def test_points_off_every_line_are_false():
    image = truth(None)
    view = View(image, SETTINGS, {})
    pose = image.view.pose
    geometry = ImageGeometry(
        CameraView(image.view.intrinsics, CameraPose(pose.position - (*PLACE, 0.0), pose.rotation))
    )
    points = np.array([(1.3, 0.1 * index) for index in range(-3, 4)])
    percepts = Percepts(0, None, (), points, np.zeros((7, 3)), (), NOTHING)
    assert score_image(image, view, percepts, geometry).false_lines == 1
    on_line = points + (3.0 - 1.3, -0.3)  # the halfway line is 3 m ahead
    good = score_image(image, view, replace(percepts, line_points=on_line), geometry)
    assert good.false_line_points == 0
    assert good.line_error_median() == pytest.approx(0.0, abs=1e-6)
