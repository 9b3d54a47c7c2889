"""The three-dimensional scene: robot, soles, pendulum, footprints."""

from collections import deque
from typing import Any

import numpy as np
import pinocchio as pin

from gait_lab.analysis.body import (
    Shapes,
    footprint_of,
    inverse_pose,
    planar_pose,
    shapes_of,
    torso_over_soles,
)
from gait_lab.view.link import Heard
from gait_lab.view.model import LinkPoses
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray

LEFT_COLOR, RIGHT_COLOR = (200, 85, 61), (47, 127, 95)
COM_COLOR, ORIGIN_COLOR, PENDULUM_COLOR = (224, 160, 48), (30, 90, 200), (15, 124, 148)
PRINTS = 60
"""Footprints that stay."""
SIDES = (("left", LEFT_COLOR, 1.0), ("right", RIGHT_COLOR, -1.0))


class RobotScene:
    """What the browser shows. The world is ground truth's, or odom where there is none."""

    def __init__(self, server: Any, robot: RobotDescription) -> None:
        self._scene = server.scene
        self._robot = robot
        shapes = shapes_of(robot.urdf)
        self._poses = LinkPoses(robot, shapes.links)
        self._frames = [
            self._scene.add_frame(f"/robot/{name}", show_axes=False) for name in shapes.links
        ]
        self._meshes: list[Any] = []
        self._add_meshes(shapes)
        self._scene.set_up_direction("+z")
        self._scene.add_grid(
            "/floor", width=20.0, height=20.0, cell_size=0.1, section_size=0.5,
            cell_color=(222, 226, 230), section_color=(180, 188, 196), infinite_grid=True,
            fade_distance=6.0,
        )  # fmt: skip
        self._support = {
            side: self._outline(f"/support/{side}", color, mirror, 0.006)
            for side, color, mirror in SIDES
        }
        self.com = self._scene.add_icosphere("/pendulum/com", radius=0.014, color=COM_COLOR)
        self.origin = self._scene.add_cylinder(
            "/pendulum/origin", radius=0.011, height=0.006, color=ORIGIN_COLOR
        )
        self._pendulum: Any = None
        self._prints: deque[Any] = deque()
        self._print_count = 0
        self._last_support = ""
        self.base: tuple[float, float, float] = (0.0, 0.0, 0.0)
        """x, y [m], yaw [rad] of the middle between the soles as drawn."""

    def _add_meshes(self, shapes: Shapes) -> None:
        colors = np.array(shapes.color)
        for index, name in enumerate(shapes.links):
            of_link = shapes.link[shapes.triangle[:, 0]] == index
            for number, color in enumerate(sorted(set(colors[of_link]))):
                faces = shapes.triangle[of_link & (colors == color)]
                used, local = np.unique(faces, return_inverse=True)
                mesh = self._scene.add_mesh_simple(
                    f"/robot/{name}/{number}",
                    shapes.vertex[used].astype(np.float32),
                    local.reshape(faces.shape).astype(np.uint32),
                    color=tuple(int(value) for value in color[4:-1].split(",")),
                    flat_shading=True, side="double",
                )  # fmt: skip
                self._meshes.append(mesh)

    def see_through(self, through: bool) -> None:
        """Let the pendulum show inside the robot."""
        opacity = 0.3 if through else None
        for mesh in self._meshes:
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

    def update(self, heard: Heard) -> bool:
        """Draw what was heard; False as long as there is nothing to draw."""
        if not heard.joints:
            return False
        links, soles = self._poses.at(heard.joint_names, heard.joints)
        torso, odom = self._placed(heard, soles)
        for frame, pose in zip(self._frames, torso @ links, strict=True):
            _put(frame, pose)
        soles_in_world = torso @ soles
        x, y, yaw = footprint_of(soles_in_world[None])[0].tolist()
        self.base = x, y, yaw
        self._show_support(heard, soles_in_world)
        self._show_pendulum(heard, odom)
        return True

    def _placed(self, heard: Heard, soles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The torso, and odom, in the scene; from the truth of the moment of the joints."""
        odometry = heard.odometry.get(heard.stamp)
        if odometry is None:
            odometry = next(reversed(heard.odometry.values()), (0.0, 0.0, 0.0))
        torso = heard.truth.get(heard.stamp)
        if torso is None and heard.truth:
            torso = next(reversed(heard.truth.values()))
        if torso is None:
            return torso_over_soles(np.array([odometry]), soles[None])[0], np.eye(4)
        footprint = planar_pose(*footprint_of((torso @ soles)[None]).T)[0]
        return torso, footprint @ inverse_pose(planar_pose(*np.array([odometry]).T)[0])

    def _show_support(self, heard: Heard, soles: FloatArray) -> None:
        support = heard.support.rpartition(" ")[2]
        for index, (side, color, mirror) in enumerate(SIDES):
            flat = planar_pose(*footprint_of(soles[None, [index, index]]).T)[0]
            outline = self._support[side]
            outline.visible = support in (side, "double")
            _put(outline, flat)
            if support == side and support != self._last_support:
                self._print_count += 1
                mark = self._outline(f"/prints/{self._print_count}", color, mirror, 0.002)
                _put(mark, flat)
                mark.visible = True
                self._prints.append(mark)
                if len(self._prints) > PRINTS:
                    self._prints.popleft().remove()
        self._last_support = support

    def _show_pendulum(self, heard: Heard, odom: FloatArray) -> None:
        points = {}
        for name, handle in (("com", self.com), ("pendulum origin", self.origin)):
            pose = heard.markers.get(name)
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
                    "/pendulum/rod", line, PENDULUM_COLOR, thickness=0.005
                )
            else:
                self._pendulum.points = line


def _put(handle: Any, pose: FloatArray) -> None:
    x, y, z, w = pin.Quaternion(np.ascontiguousarray(pose[:3, :3])).coeffs()
    handle.position = pose[:3, 3]
    handle.wxyz = (w, x, y, z)
