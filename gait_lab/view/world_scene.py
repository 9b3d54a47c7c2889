"""What a player estimates, beside the truth: its particles, its pose with its error, its ball."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gait_lab.view.robot_link import FAR
from robot_core.errors import NaoGaitError
from robot_core.field import SIDES, TEAMS
from robot_core.message_checks import read_array
from robot_core.types import FloatArray

if TYPE_CHECKING:
    from rclpy.node import Node

HEIGHT = 0.01
"""[m] at which everything is drawn."""
ARROW = 0.06
"""[m] Length of a particle."""
MOST_PARTICLES = 10_000
DEVIATIONS = 2.0
"""Size of the ellipse of the pose, in standard deviations."""
CORNERS = 32
"""Number of corners of the ellipse."""
VALID, NOT_VALID, PARTICLES, BALL = (40, 120, 220), (215, 60, 50), (120, 130, 140), (250, 160, 60)


class WorldScene:
    """What one player publishes, drawn as soon as it does.

    Args:
        node: The node that subscribes.
        server: The viser server of the page.
        name: Of the robot, below which its topics are; "" for the only one.
        team: Of the robot: its field is turned by half a turn for the team that plays towards
            negative x.
    """

    def __init__(self, node: "Node", server: Any, name: str = "", team: str = TEAMS[0]) -> None:
        from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
        from nav_msgs.msg import Odometry
        from std_msgs.msg import Bool

        from robot_core.ros.topics import RELIABLE, Inputs

        inputs = Inputs(node, name, burst=1)
        self._scene = server.scene
        self._root = f"/{name}/belief" if name else "/belief"
        self._side = -SIDES[TEAMS.index(team)]
        self._valid = False
        self._changed: dict[str, FloatArray] = {}
        self._ball: tuple[float, float, float] | None = None
        below = f"{name}/" if name else ""
        for kind, topic, receive in (
            (PoseWithCovarianceStamped, "pose", self._on_pose),
            (Bool, "pose_valid", self._on_valid),
            (PoseArray, "particles", self._on_particles),
            (Odometry, "ball", self._on_ball),
        ):
            inputs.subscribe(kind, below + topic, receive, RELIABLE)
        self.lines: dict[str, Any] = {}
        self.ball: Any = None

    def update(self) -> None:
        """Draw what has come since the last call."""
        for name, segments in self._changed.items():
            color = PARTICLES
            if name == "pose":
                color = VALID if self._valid else NOT_VALID
            # A handle has no colours that could be changed for all of its lines.
            self.lines[name] = self._scene.add_line_segments(
                f"{self._root}/{name}", segments.astype(np.float32), color, thickness=0.006
            )
        self._changed.clear()
        if self._ball is not None:
            if self.ball is None:
                self.ball = self._scene.add_icosphere(
                    f"{self._root}/ball", radius=self._ball[2], color=BALL, opacity=0.5
                )
            self.ball.position = self._ball

    # -- messages ----------------------------------------------------------------------------------

    def _on_valid(self, message: Any) -> None:
        self._valid = bool(message.data)

    def _on_pose(self, message: Any) -> None:
        place, q = message.pose.pose.position, message.pose.pose.orientation
        pose = np.array((place.x, place.y, 2.0 * math.atan2(q.z, q.w)))
        covariance = np.array(message.pose.covariance).reshape(6, 6)[:2, :2]
        outline = ellipse(covariance) + pose[:2]
        arrow = np.array((pose[:2], pose[:2] + 0.3 * _direction(pose[2:])[0]))
        segments = np.concatenate((np.stack((outline, np.roll(outline, -1, 0)), 1), arrow[None]))
        self._changed["pose"] = self._placed(segments)

    def _on_particles(self, message: Any) -> None:
        if len(message.poses) > MOST_PARTICLES:
            allowed = f"at most {MOST_PARTICLES}"
            raise NaoGaitError("particles", f"{len(message.poses)} poses", allowed)
        poses = np.array(
            [
                (p.position.x, p.position.y, 2.0 * math.atan2(p.orientation.z, p.orientation.w))
                for p in message.poses
            ]
        ).reshape(-1, 3)
        ends = poses[:, :2] + ARROW * _direction(poses[:, 2])
        self._changed["particles"] = self._placed(np.stack((poses[:, :2], ends), axis=1))

    def _on_ball(self, message: Any) -> None:
        p = message.pose.pose.position
        x, y, radius = read_array((p.x, p.y, p.z), "ball", (3,), FAR, "m", "xyz").tolist()
        self._ball = self._side * x, self._side * y, max(0.02, radius)

    def _placed(self, segments: FloatArray) -> FloatArray:
        """Segments (n, 2, 2) of the player's field as (n, 2, 3) of the world.

        Raises:
            NaoGaitError: A corner is too far away to be drawn, or not finite.
        """
        if not (np.abs(segments) <= FAR).all():  # false for NaN as well
            raise NaoGaitError("pose or particles", "a place too far away", f"up to {FAR:g} m")
        result: FloatArray = np.concatenate(
            (self._side * segments, np.full((*segments.shape[:2], 1), HEIGHT)), axis=2
        )
        return result


def ellipse(covariance: FloatArray) -> FloatArray:
    """Corners (n, 2) [m] of the ellipse of a covariance (2, 2) about 0."""
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0.0, math.tau, CORNERS, endpoint=False)
    circle = np.stack((np.cos(angle), np.sin(angle)))
    stretched = DEVIATIONS * np.sqrt(np.maximum(values, 0.0))[:, None] * circle
    result: FloatArray = (vectors @ stretched).T
    return result


def _direction(yaw: FloatArray) -> FloatArray:
    """Unit vectors (n, 2)."""
    return np.stack((np.cos(yaw), np.sin(yaw)), axis=1)
