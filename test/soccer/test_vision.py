import math

import cv2
import numpy as np
import pytest

from nao_soccer.vision.colors import load_color_table
from nao_soccer.vision.detector import Vision
from nao_soccer.vision.percepts import CROSSINGS, Kind, Percepts
from nao_soccer.vision.robots import find_torsos
from nao_soccer.vision.settings import VisionSettings, settings_of_scene
from nao_soccer.vision.tilt_calibration import TiltCalibration
from pitch_image import WHITE, camera, picture
from robot_core.field import Field, Goals
from robot_core.robot.camera import CameraPose, CameraView

SETTINGS = VisionSettings(goals=Goals())
TABLE = load_color_table("pitch")
TEAM_RED = (200, 30, 30)


def see(view: CameraView, image: np.ndarray) -> Percepts:
    """Percepts in the frame of the field, because the camera is given in it."""
    return Vision(TABLE, SETTINGS).see(0, image, view)


@pytest.mark.parametrize("distance", [0.6, 1.5, 3.0])
@pytest.mark.parametrize("brightness", [0.6, 1.0, 1.4])
def test_ball_is_where_it_is(distance: float, brightness: float):
    view = camera(-3.0, 0.3, 0.2, tilt=0.6 if distance < 1.0 else 0.25)
    ball = (-3.0 + distance * math.cos(0.3), 0.3 + distance * math.sin(0.3))
    found = see(view, picture(view, ball, brightness=brightness)).ball
    assert found is not None
    assert math.dist(found.position, ball) < 0.02 * distance + 0.005


def test_over_exposed_ball_is_found():
    """Its red is at the limit of the camera, and its green follows: the hue is that of yellow."""
    view = camera(-3.0, 0.3, 0.2)
    ball = (-3.0 + 1.5 * math.cos(0.3), 0.3 + 1.5 * math.sin(0.3))
    found = see(view, picture(view, ball, brightness=1.9)).ball
    assert found is not None
    assert math.dist(found.position, ball) < 0.04


def test_no_ball_is_seen_where_there_is_none():
    for seed in range(5):
        view = camera(-2.0 + seed, 0.5, 0.8 * seed)
        assert see(view, picture(view, seed=seed)).ball is None


def test_orange_bar_is_no_ball():
    view = camera(-3.0, 0.3, 0.2)
    image = picture(view)
    image[150:162, 140:180] = (242, 115, 13)
    assert see(view, image).ball is None


def test_orange_joint_at_the_edge_of_the_image_is_no_ball():
    """Half of a disc is a ball on bare field, but not below a white limb."""
    view = camera(-3.0, 0.3, 0.2)
    left = 0.2 + math.atan(166.0 / view.intrinsics.fx)  # [rad] its centre is at the edge
    ball = picture(view, (-3.0 + 1.5 * math.cos(left), 0.3 + 1.5 * math.sin(left)))
    limb = ball.copy()
    orange = ball[..., 0] > 1.3 * ball[..., 1]
    row = round(np.nonzero(orange)[0].mean())
    limb[: row + 1, :24][~orange[: row + 1, :24]] = WHITE
    assert see(view, limb).ball is None
    assert see(view, ball).ball is not None


def test_line_points_lie_on_lines():
    view = camera(-3.2, 0.6, 0.3)
    points = see(view, picture(view)).line_points
    assert len(points) > 50
    field = Field()
    off = np.abs(np.hypot(*points.T) - 0.5 * field.circle_diameter)
    for line in field.lines():
        (x0, y0), (x1, y1) = line.start, line.end
        along = np.clip(points, (min(x0, x1), min(y0, y1)), (max(x0, x1), max(y0, y1)))
        off = np.minimum(off, np.hypot(*(points - along).T))
    reach2 = (points[:, 0] + 3.2) ** 2 + (points[:, 1] - 0.6) ** 2
    assert (off < 0.02 + reach2 / (0.47 * 361.0)).all()  # a pixel on the ground


@pytest.mark.parametrize(
    ("place", "heading"),
    [((2.2, -0.6), -0.9), ((3.0, 1.5), 0.9), ((2.6, 0.1), 0.6), ((-1.2, 1.6), 1.0)],
)
def test_crossings_have_their_place_kind_and_yaw(place: tuple[float, float], heading: float):
    view = camera(*place, heading)
    found = see(view, picture(view)).of(*CROSSINGS)
    assert found
    for each in found:
        truth = min(Field().crossings(), key=lambda one: math.dist((one.x, one.y), each.position))
        assert math.dist((truth.x, truth.y), each.position) < 0.15
        assert each.kind.value == f"crossing_{truth.kind.value.lower()}"
        turn = 0.5 * math.pi if truth.kind.value == "X" else 2.0 * math.pi
        assert abs(math.remainder(each.yaw - truth.heading, turn)) < 0.15


@pytest.mark.parametrize("aside", [-0.1, 0.0, 0.1])
def test_corner_whose_line_leads_away_from_the_camera_is_a_crossing(aside: float):
    corner = (3.9, 1.1)  # of the goal area
    view = camera(corner[0] - 2.6, corner[1] + aside, 0.0)
    found = see(view, picture(view)).of(Kind.CROSSING_L)
    assert any(math.dist(each.position, corner) < 0.15 for each in found)


@pytest.mark.parametrize("distance", [1.5, 0.7])
def test_robot_is_placed_while_its_feet_are_at_least_near_the_image(distance: float):
    view = camera(-2.5, 2.0, 0.0)
    place = (-2.5 + distance, 2.0)
    image = picture(view)
    paint_upright(image, view, place, 0.1, (0.0, 0.23), WHITE)
    paint_upright(image, view, place, 0.14, (0.23, 0.43), TEAM_RED)
    (found,) = see(view, image).of(Kind.ROBOT_RED)
    assert math.dist(found.position, place) < 0.1 + 0.05 * distance


@pytest.mark.parametrize("aside", [-0.06, 0.0, 0.06])
@pytest.mark.parametrize("distance", [0.25, 0.35, 0.45])
def test_robot_whose_feet_are_below_the_image_is_placed_by_its_torso(
    distance: float, aside: float
):
    """As exactly as its covariance says, while the head follows a ball at the feet."""
    view = camera(-2.5, 2.0, 0.0, tilt=0.5)
    place = (-2.5 + distance, 2.0 + aside)
    image = picture(view)
    paint_upright(image, view, place, 0.1, (0.0, 0.23), WHITE)
    paint_upright(image, view, place, 0.14, (0.23, 0.43), TEAM_RED)
    (found,) = see(view, image).of(Kind.ROBOT_RED)
    assert math.dist(found.position, place) < 2.0 * math.sqrt(found.covariance[0])
    assert math.sqrt(found.covariance[0]) < 0.15


@pytest.mark.parametrize("aside", [-0.15, 0.1])
@pytest.mark.parametrize("distance", [0.6, 1.2, 1.8])
def test_robot_that_lies_is_placed(distance: float, aside: float):
    view = camera(-2.5, 2.0, 0.0, tilt=0.35)
    place = (-2.5 + distance, 2.0 + aside)
    image = picture(view)
    paint_upright(image, view, place, 0.3, (0.0, 0.1), WHITE)
    paint_upright(image, view, place, 0.22, (0.04, 0.16), TEAM_RED)
    (found,) = see(view, image).of(Kind.ROBOT_RED)
    assert math.dist(found.position, place) < 0.1


@pytest.mark.parametrize("height", [0.05, 0.2, 0.3])
def test_the_own_body_is_no_robot(height: float):
    """A camera that looks down past the chest sees the own colour below itself."""
    view = camera(-2.5, 2.0, 0.0, tilt=1.2)
    image = picture(view)
    paint_upright(image, view, (-2.45, 2.02), 0.15, (0.0, height), TEAM_RED)
    assert (image == TEAM_RED).all(axis=2).sum() > 100
    assert not see(view, image).of(Kind.ROBOT_RED)


def test_robot_is_not_placed_if_its_torso_does_not_tell_how_near_it_is():
    view = camera(-2.5, 2.0, 0.0, tilt=0.0)
    image = picture(view)
    paint_upright(image, view, (-1.9, 2.0), 0.1, (0.0, 0.23), WHITE)
    paint_upright(image, view, (-1.9, 2.0), 0.14, (0.36, 0.43), TEAM_RED)
    assert not see(view, image).of(Kind.ROBOT_RED)


@pytest.mark.parametrize("aside", [-0.06, 0.0, 0.06])
@pytest.mark.parametrize("heading", [-0.15, 0.0])
@pytest.mark.parametrize("distance", [1.2, 1.8, 2.8])
def test_robot_on_a_line_that_leads_to_the_camera_is_placed_at_its_feet(
    distance: float, heading: float, aside: float
):
    """Line and feet are equally white."""
    touch_line = 0.5 * Field().width
    view = camera(-2.5, touch_line - 0.3 * math.sin(-heading), heading)
    place = (-2.5 + distance, touch_line + aside)
    image = picture(view)
    paint_upright(image, view, place, 0.2, (0.0, 0.23), WHITE)
    paint_upright(image, view, place, 0.14, (0.23, 0.43), TEAM_RED)
    (found,) = see(view, image).of(Kind.ROBOT_RED)
    assert math.dist(found.position, place) < 0.06 + 0.04 * distance


def test_column_behind_the_field_is_no_torso():
    view = camera(-2.5, 2.0, 0.0)
    for behind, count in ((True, 0), (False, 1)):
        image, vision = picture(view), Vision(TABLE, SETTINGS)
        place = (6.0, 1.0) if behind else (-0.5, 2.0)
        paint_upright(image, view, place, 0.3 if behind else 0.14, (0.0, 0.5), TEAM_RED)
        vision.see(0, image, view)
        assert vision.frame is not None
        assert len(find_torsos(vision.frame)) == count


def paint_upright(
    image: np.ndarray,
    view: CameraView,
    place: tuple[float, float],
    width: float,
    heights: tuple[float, float],
    color: tuple[int, int, int],
) -> None:
    """Paint an upright rectangle at a place, across a view along x, between two heights [m]."""
    half, (low, high) = 0.5 * width, heights
    x, y = place
    corners = np.array([(x, y - half, low), (x, y + half, low), (x, y + half, high),
                        (x, y - half, high)])  # fmt: skip
    cv2.fillConvexPoly(image, np.rint(view.project(corners)).astype(np.int32), color)


def test_centre_circle_is_found_from_both_sides_and_not_elsewhere():
    for x, heading in ((-2.0, 0.0), (2.0, math.pi)):
        view = camera(x, 0.4, heading)
        (circle,) = see(view, picture(view)).of(Kind.CENTRE_CIRCLE)
        assert math.hypot(*circle.position) < 0.1
    for heading in (-0.5, 0.0, 0.5):
        view = camera(2.2, 0.4, heading)
        assert not see(view, picture(view)).of(Kind.CENTRE_CIRCLE)


def test_covariance_is_that_of_disturbed_cameras():
    view = camera(-3.0, 0.3, 0.2)
    vision = Vision(TABLE, SETTINGS)
    percepts = vision.see(0, picture(view), view)
    assert vision.frame is not None
    geometry = vision.frame.geometry
    place = percepts.line_points[:1]
    pixel = geometry.pixels_of(place)
    xx, xy, yy = geometry.covariance(place)[0]
    random, error, seen = np.random.default_rng(0), geometry.error, []
    for _ in range(4000):
        roll, pitch, yaw = random.normal(0.0, (error.tilt, error.tilt, error.pan))
        turn = np.array(((1.0, -yaw, pitch), (yaw, 1.0, -roll), (-pitch, roll, 1.0)))
        height = random.normal(0.0, error.height)
        pose = CameraPose(view.pose.position + (0.0, 0.0, height), turn @ view.pose.rotation)
        other = CameraView(view.intrinsics, pose)
        seen.append(other.on_plane(pixel + random.normal(0.0, error.pixel, (1, 2)))[0, :2])
    sampled = np.cov(np.array(seen).T)
    assert np.allclose(sampled, [[xx, xy], [xy, yy]], atol=0.25 * max(xx, yy))


def test_lasting_tilt_is_learned_from_the_ball():
    """The pose that vision is given looks 2 degrees too high."""
    calibration = TiltCalibration(SETTINGS.error)
    vision = Vision(TABLE, SETTINGS, calibration)
    ball = (-1.2, 0.3)
    for step in range(6):
        view = camera(-3.0, 0.3, 0.01 * step, tilt=0.25)
        told = camera(-3.0, 0.3, 0.01 * step, tilt=0.25 - math.radians(2.0))
        found = vision.see(step, picture(view, ball, seed=step), told).ball
        assert found is not None
    corrected = calibration.correct(told)
    assert math.asin(-corrected.pose.rotation[2, 2]) == pytest.approx(0.25, abs=math.radians(0.3))


def test_settings_come_from_the_scene():
    assert settings_of_scene("pitch_small").field.length == pytest.approx(4.5)
    assert settings_of_scene("pitch").ball_radius == pytest.approx(0.05)
