"""The three-dimensional scene: robot, support soles, pendulum and footprints."""

from collections import deque
from typing import Any

import numpy as np
import pinocchio as pin

from gait_lab.analysis.body import (
    LinkPoses,
    Shapes,
    footprint_of,
    inverse_pose,
    planar_pose,
    shapes_of,
    torso_over_soles,
)
from gait_lab.view.robot_link import MARKERS, RobotState
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.shapes import Color

LEFT_COLOR, RIGHT_COLOR = (200, 85, 61), (47, 127, 95)
COM_COLOR, ORIGIN_COLOR, PENDULUM_COLOR = (224, 160, 48), (30, 90, 200), (15, 124, 148)
PRINTS = 60
"""Number of footprints shown."""
SIDES = (("left", LEFT_COLOR, 1.0), ("right", RIGHT_COLOR, -1.0))


class RobotScene:
    """The scene in the browser, in the world of the ground truth, or in odom without it.

    Args:
        server: The viser server of the page.
        robot: The robot to show.
        name: Of a robot out of several; "" for the only one, which walks on a grid.
        color: Of its torso; None for that of the URDF.

    Attributes:
        base: Position x, y [m] and heading [rad] of the middle between the soles.
        com: Sphere at the CoM.
        origin: Cylinder at the pendulum origin.
        frames: Frames of the links.
        meshes: Meshes of the links.
        prints: Footprints, oldest first.
    """

    def __init__(
        self, server: Any, robot: RobotDescription, name: str = "", color: Color | None = None
    ) -> None:
        self._scene = server.scene
        self._robot = robot
        self._root = f"/{name}" if name else ""
        shapes = shapes_of(robot.urdf)
        self._poses = LinkPoses(robot, shapes.links)
        self.frames = [
            self._scene.add_frame(f"{self._root}/robot/{link}", show_axes=False)
            for link in shapes.links
        ]
        self.meshes: list[Any] = []
        self._add_meshes(shapes, color)
        self._scene.set_up_direction("+z")
        if not name:
            self._add_grid()
        self._support = {
            side: self._outline(f"{self._root}/support/{side}", color, mirror, 0.006)
            for side, color, mirror in SIDES
        }
        self.com = self._scene.add_icosphere(
            f"{self._root}/pendulum/com", radius=0.014, color=COM_COLOR
        )
        self.origin = self._scene.add_cylinder(
            f"{self._root}/pendulum/origin", radius=0.011, height=0.006, color=ORIGIN_COLOR
        )
        self._pendulum: Any = None
        self.prints: deque[Any] = deque()
        self._print_count = 0
        self._last_support = ""
        self.base: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def _add_grid(self) -> None:
        self._scene.add_grid(
            "/floor", width=20.0, height=20.0, cell_size=0.1, section_size=0.5,
            cell_color=(222, 226, 230), section_color=(180, 188, 196), infinite_grid=True,
            fade_distance=6.0,
        )  # fmt: skip

    def _add_meshes(self, shapes: Shapes, torso: Color | None) -> None:
        colors = np.array(shapes.color)
        for index, name in enumerate(shapes.links):
            painted = None
            if torso is not None and name == self._robot.upper_body_frame:
                painted = tuple(round(255 * value) for value in torso)
            of_link = shapes.link[shapes.triangle[:, 0]] == index
            for number, color in enumerate(sorted(set(colors[of_link]))):
                faces = shapes.triangle[of_link & (colors == color)]
                used, local = np.unique(faces, return_inverse=True)
                mesh = self._scene.add_mesh_simple(
                    f"{self._root}/robot/{name}/{number}",
                    shapes.vertex[used].astype(np.float32),
                    local.reshape(faces.shape).astype(np.uint32),
                    color=painted or tuple(bytes.fromhex(color[1:])),
                    flat_shading=True, side="double",
                )  # fmt: skip
                self.meshes.append(mesh)

    def see_through(self, through: bool) -> None:
        """Make the robot transparent, so that the pendulum is visible."""
        opacity = 0.3 if through else None
        for mesh in self.meshes:
            if mesh.opacity != opacity:
                mesh.opacity = opacity

    def _outline(
        self, name: str, color: tuple[int, int, int], mirror: float, thickness: float
    ) -> Any:
        points = np.array(self._robot.sole_outline) * (1.0, mirror)
        corners = np.column_stack([points, np.full(len(points), 0.003)])
        segments = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        return self._scene.add_line_segments(
            name, segments.astype(np.float32), color, thickness=thickness, visible=False
        )

    def update(self, state: RobotState) -> bool:
        """Draw the newest messages; return False as long as there are no joint states."""
        if not state.joints:
            return False
        links, soles = self._poses.at(state.joint_names, state.joints)
        torso, odom = self._placed(state, soles)
        for frame, pose in zip(self.frames, torso @ links, strict=True):
            _put(frame, pose)
        soles_in_world = torso @ soles
        x, y, yaw = footprint_of(soles_in_world[None])[0].tolist()
        self.base = x, y, yaw
        self._show_support(state, soles_in_world)
        self._show_pendulum(state, odom)
        return True

    def _placed(self, state: RobotState, soles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the poses of torso and odom in the scene, for the stamp of the joints."""
        odometry = state.odometry.get(state.stamp)
        if odometry is None:
            odometry = next(reversed(state.odometry.values()), (0.0, 0.0, 0.0))
        torso = state.truth.get(state.stamp)
        if torso is None and state.truth:
            torso = next(reversed(state.truth.values()))
        if torso is None:
            return torso_over_soles(np.array([odometry]), soles[None])[0], np.eye(4)
        footprint = planar_pose(*footprint_of((torso @ soles)[None]).T)[0]
        return torso, footprint @ inverse_pose(planar_pose(*np.array([odometry]).T)[0])

    def _show_support(self, state: RobotState, soles: FloatArray) -> None:
        support = state.support.rpartition(" ")[2]
        for index, (side, color, mirror) in enumerate(SIDES):
            flat = planar_pose(*footprint_of(soles[None, [index, index]]).T)[0]
            outline = self._support[side]
            outline.visible = support in (side, "double")
            _put(outline, flat)
            if support == side and support != self._last_support:
                self._print_count += 1
                name = f"{self._root}/prints/{self._print_count}"
                mark = self._outline(name, color, mirror, 0.002)
                _put(mark, flat)
                mark.visible = True
                self.prints.append(mark)
                if len(self.prints) > PRINTS:
                    self.prints.popleft().remove()
        self._last_support = support

    def _show_pendulum(self, state: RobotState, odom: FloatArray) -> None:
        points = {}
        for name, handle in zip(MARKERS, (self.com, self.origin), strict=True):
            pose = state.markers.get(name)
            handle.visible = pose is not None
            if pose is not None:
                p = pose.position
                place = odom @ np.array([p.x, p.y, p.z, 1.0])
                handle.position = place[:3]
                points[name] = place[:3]
        if len(points) == 2:
            line = np.array([[points["com"], points["pendulum origin"]]], dtype=np.float32)
            if self._pendulum is None:
                self._pendulum = self._scene.add_line_segments(
                    f"{self._root}/pendulum/rod", line, PENDULUM_COLOR, thickness=0.005
                )
            else:
                self._pendulum.points = line


def _put(handle: Any, pose: FloatArray) -> None:
    x, y, z, w = pin.Quaternion(np.ascontiguousarray(pose[:3, :3])).coeffs()
    handle.position = pose[:3, 3]
    handle.wxyz = (w, x, y, z)
