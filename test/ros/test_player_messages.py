"""Percepts survive the way from `vision` to `player`; messages of others are refused."""

import math

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, PointCloud2
from std_msgs.msg import Header

from nao_soccer.ros import player_messages, vision_messages
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.world.state import PoseEstimate
from nao_soccer.world.team_knowledge import in_field
from pitch_percepts import Eyes
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose
from robot_core.ros.messages import with_prefix
from robot_core.types import PoseCovariance

STAMP = 12_345_000_000


def test_percepts_survive_the_way_to_the_player():
    percepts = Eyes().see(STAMP, (-1.0, 0.2, 0.1), (0.3, 0.4))
    robot = Percept(Kind.ROBOT_BLUE, (1.5, -0.4), (0.01, 0.002, 0.02))
    percepts = Percepts(
        STAMP, percepts.ball, (*percepts.objects, robot), percepts.line_points,
        percepts.line_covariances, (), percepts.boundary, percepts.visible,
    )  # fmt: skip
    joined = player_messages.percepts(vision_messages.percept_cloud(percepts))
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


def info(**fields: object) -> CameraInfo:
    k = [300.0, 0.0, 160.0, 0.0, 310.0, 120.0, 0.0, 0.0, 1.0]
    return CameraInfo(width=320, height=240, k=k, **fields)


P = [280.0, 0.0, 155.0, 0.0, 0.0, 290.0, 118.0, 0.0, 0.0, 0.0, 1.0, 0.0]


def test_a_rectified_camera_is_described_by_its_projection_matrix():
    raw = vision_messages.intrinsics(info(), "camera_info")
    assert (raw.fx, raw.fy, raw.cx, raw.cy) == (300.0, 310.0, 160.0, 120.0)
    distortion = [0.1, -0.05, 0.0, 0.0, 0.0]
    for given, rectified in ((info(p=P), False), (info(p=P, d=distortion), True)):
        found = vision_messages.intrinsics(given, "camera_info", rectified=rectified)
        assert (found.fx, found.fy, found.cx, found.cy) == (280.0, 290.0, 155.0, 118.0)
    with pytest.raises(NaoGaitError, match=r"camera_info d: .* parameter images") as refused:
        vision_messages.intrinsics(info(p=P, d=distortion), "camera_info")
    assert "np." not in str(refused.value)
    with pytest.raises(NaoGaitError, match="camera_info p") as refused:
        vision_messages.intrinsics(info(), "camera_info", rectified=True)
    assert "np." not in str(refused.value)


def test_a_prefix_comes_before_both_frames_of_a_message():
    transform, _ = player_messages.map_transforms(STAMP, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), "odom")
    message = with_prefix("red1/", transform)
    assert (message.header.frame_id, message.child_frame_id) == ("red1/map", "red1/odom")


def with_kind(kind: float) -> PointCloud2:
    """One percept of a kind by its number."""
    message = vision_messages.percept_cloud(
        Percepts(STAMP, Percept(Kind.BALL, (1.0, 0.0), (0.01, 0.0, 0.01)))
    )
    rows = np.frombuffer(bytes(message.data), "<f4").copy()
    rows[7] = kind
    message.data = rows.tobytes()
    return message


def without_data() -> PointCloud2:
    """A cloud that says that it has a point."""
    message = with_kind(0.0)
    message.data = b""
    return message


@pytest.mark.parametrize(
    ("message", "field"),
    [
        (PointCloud2(header=Header(frame_id="base_footprint")), "vision/percepts"),
        (PointCloud2(), "vision/percepts header.frame_id"),
        (without_data(), "vision/percepts data"),
        (with_kind(11.0), "vision/percepts kind"),
        (with_kind(0.5), "vision/percepts kind"),
        (with_kind(math.nan), "vision/percepts kind"),
    ],
)
def test_clouds_of_others_are_refused_in_one_line(message: PointCloud2, field: str):
    with pytest.raises(NaoGaitError, match=field) as refusal:
        player_messages.percepts(message)
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


def test_map_to_odom_and_odom_to_the_robot_lead_to_its_pose_in_the_field() -> None:
    own, odometry = (1.5, -0.7, 2.0), (0.4, 0.3, -1.1)
    odom, field = player_messages.map_transforms(STAMP, own, odometry, "robot1/odom")
    assert (odom.header.frame_id, odom.child_frame_id) == ("map", "robot1/odom")
    assert (field.header.frame_id, field.child_frame_id) == ("map", "field")
    turn, place = odom.transform.rotation, odom.transform.translation
    there = compose((place.x, place.y, 2.0 * math.atan2(turn.z, turn.w)), odometry)
    assert there[:2] == pytest.approx(own[:2])
    assert math.cos(there[2] - own[2]) == pytest.approx(1.0)
    assert field.transform.rotation.w == 1.0
