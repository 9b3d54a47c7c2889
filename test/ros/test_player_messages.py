"""Percepts survive the way from `vision` to `player`; messages of others are refused."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import PolygonStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2

from nao_soccer.ros import player_messages, vision_messages
from nao_soccer.ros.player_messages import PerceptBuffer, PerceptParts
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.world.state import PoseEstimate
from nao_soccer.world.team_knowledge import in_field
from pitch_percepts import Eyes
from robot_core.errors import NaoGaitError
from robot_core.types import PoseCovariance

STAMP = 12_345_000_000


def parts_of(percepts: Percepts) -> PerceptParts:
    """The three messages of one image."""
    return PerceptParts(
        vision_messages.lines(percepts),
        vision_messages.objects(percepts),
        vision_messages.view(percepts),
    )


def test_percepts_survive_the_way_to_the_player():
    percepts = Eyes().see(STAMP, (-1.0, 0.2, 0.1), (0.3, 0.4))
    robot = Percept(Kind.ROBOT_BLUE, (1.5, -0.4), (0.01, 0.002, 0.02))
    percepts = Percepts(
        STAMP, percepts.ball, (*percepts.objects, robot), percepts.line_points,
        percepts.line_covariances, (), percepts.boundary, percepts.visible,
    )  # fmt: skip
    joined = parts_of(percepts).joined(STAMP)
    assert joined is not None
    assert joined.stamp == STAMP
    assert joined.ball is not None
    assert percepts.ball is not None
    assert joined.ball.position == pytest.approx(percepts.ball.position, abs=1e-6)
    assert [each.kind for each in joined.objects] == [each.kind for each in percepts.objects]
    for mine, theirs in zip(joined.objects, percepts.objects, strict=True):
        assert mine.position == pytest.approx(theirs.position, abs=1e-6)
        assert mine.covariance == pytest.approx(theirs.covariance, rel=1e-6)
        assert mine.yaw == pytest.approx(theirs.yaw, abs=1e-6)
    assert np.allclose(joined.line_points, percepts.line_points, atol=1e-6)
    assert np.allclose(joined.line_covariances, percepts.line_covariances)
    assert np.allclose(joined.visible, percepts.visible, atol=1e-6)


def test_percepts_wait_until_all_messages_of_the_image_are_there():
    whole = parts_of(Eyes().see(STAMP, (-1.0, 0.2, 0.1)))
    for missing in ("lines", "objects", "view"):
        parts = PerceptParts(whole.lines, whole.objects, whole.view)
        setattr(parts, missing, None)
        assert parts.joined(STAMP) is None


def test_images_are_completed_although_the_clock_began_again_and_messages_were_lost():
    buffer, whole = PerceptBuffer(), parts_of(Eyes().see(STAMP, (-1.0, 0.2, 0.1)))
    for i in range(20):  # of these the view was lost
        assert buffer.add("lines", STAMP + i, whole.lines) is None
        assert buffer.add("objects", STAMP + i, whole.objects) is None
    for stamp in (0, 30_000_000):
        assert buffer.add("lines", stamp, whole.lines) is None
        assert buffer.add("objects", stamp, whole.objects) is None
        percepts = buffer.add("view", stamp, whole.view)
        assert percepts is not None
        assert percepts.stamp == stamp


def test_images_of_two_cameras_with_one_stamp_are_both_used():
    buffer = PerceptBuffer()
    images = [Eyes().see(STAMP, (-1.0, 0.2, yaw)) for yaw in (0.1, 1.1)]
    messages = [parts_of(image) for image in images]
    found = [
        buffer.add(part, STAMP, getattr(message, part))
        for part in ("lines", "objects", "view")
        for message in messages
    ]
    joined = [percepts for percepts in found if percepts is not None]
    assert len(joined) == 2
    for image, percepts in zip(images, joined, strict=True):
        assert np.allclose(percepts.line_points, image.line_points, atol=1e-6)
        assert np.allclose(percepts.visible, image.visible, atol=1e-6)


@pytest.mark.parametrize(
    ("parts", "field"),
    [
        (PerceptParts(PointCloud2(), PointCloud2(), PolygonStamped()), "vision/lines"),
        (
            PerceptParts(
                vision_messages.lines(Eyes().see(0, (-1.0, 0.2, 0.1))),
                PointCloud2(),
                PolygonStamped(),
            ),
            "vision/percepts",
        ),
    ],
)
def test_clouds_of_others_are_refused_in_one_line(parts: PerceptParts, field: str):
    with pytest.raises(NaoGaitError, match=field) as refusal:
        parts.joined(0)
    assert "\n" not in str(refusal.value)


def test_the_pose_is_published_with_its_covariance():
    covariance = PoseCovariance(0.01, 0.002, 0.02, 0.001, -0.003, 0.04)
    message = player_messages.pose(STAMP, PoseEstimate((1.0, -2.0, 2.5), covariance, True))
    assert message.header.frame_id == "field"
    turn = message.pose.pose.orientation
    assert 2.0 * math.atan2(turn.z, turn.w) == pytest.approx(2.5)
    full = np.array(message.pose.covariance).reshape(6, 6)
    assert np.allclose(full, full.T)
    assert full[0, 0] == 0.01
    assert full[1, 5] == -0.003
    assert full[5, 5] == 0.04


def test_the_velocity_of_the_ball_is_as_uncertain_as_along_the_axes_of_its_frame():
    own = PoseEstimate((1.0, -2.0, math.pi / 2.0), PoseCovariance(), True)
    ball = in_field(
        own, (0.5, 0.0), (1.0, 0.0), (0.01, 0.0, 0.01), (0.09, 0.02, 0.01),
        age=0.0, seen_recently=True,
    )  # fmt: skip
    twist = player_messages.ball(STAMP, ball, 0.05).twist
    assert twist.twist.linear.y == pytest.approx(1.0)
    planar = np.array(twist.covariance).reshape(6, 6)[:2, :2]
    assert np.allclose(planar, ((0.01, -0.02), (-0.02, 0.09)))


def test_odometry_of_a_message_is_planar():
    message = Odometry()
    message.header.stamp.sec = 3
    message.pose.pose.position.x = 1.5
    message.pose.pose.orientation.z = math.sin(0.35)
    message.pose.pose.orientation.w = math.cos(0.35)
    stamp, pose = player_messages.odometry(message)
    assert stamp == 3_000_000_000
    assert pose == pytest.approx((1.5, 0.0, 0.7))
