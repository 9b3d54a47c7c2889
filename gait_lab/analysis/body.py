"""The robot's body in a recording: poses of its parts, and the shapes of its links."""

import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from gait_lab.analysis.recorded_walk import RecordedWalk
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray
from sim_bridge.meshes import mesh_of
from sim_bridge.shapes import read_colors, read_shapes
from sim_bridge.trials.trace import IntArray


def robot_of(walk: RecordedWalk) -> tuple[RobotDescription | None, str]:
    """The robot of a bag: from its own URDF, else the shipped one.

    Returns:
        The robot and where it is from; None and the reason if the recorded joints do not fit it.
    """
    if not walk.joint_names:
        return None, "no joint states"
    if walk.urdf is not None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "robot.urdf")
            path.write_text(walk.urdf, encoding="utf-8")
            try:
                return _checked(walk, load_robot(path)), "from the bag's robot_description"
            except NaoGaitError as error:
                reason = f"the bag's robot_description: {error}"
    else:
        reason = "no robot_description in the bag"
    try:
        return _checked(walk, load_robot()), f"{reason}; the shipped NAO H21 instead"
    except NaoGaitError as error:
        return None, str(error)


def _checked(walk: RecordedWalk, robot: RobotDescription) -> RobotDescription:
    unknown = [name for name in robot.joint_names if name not in walk.joint_names]
    if unknown:
        raise NaoGaitError("joint_states", f"no {', '.join(unknown)}", "the joints of the robot")
    return robot


@dataclass(frozen=True, slots=True)
class BodyTrack:
    """The body at t joint states, in the world (in odom without ground truth).

    Attributes:
        stamp: (t,) [ns].
        torso: (t, 4, 4) pose; NaN where unknown.
        sole: (t, 2, 4, 4) poses of the left and the right sole.
        com: (t, 3) [m] from the joints and the masses of the model.
        links: (t, l, 4, 4) poses of the links that were asked for.
    """

    stamp: IntArray
    torso: FloatArray
    sole: FloatArray
    com: FloatArray
    links: FloatArray
    from_truth: bool


class LinkPoses:
    """Forward kinematics of the links and soles of one robot."""

    def __init__(self, robot: RobotDescription, links: tuple[str, ...]) -> None:
        self._model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
        self._data = self._model.createData()
        self._q = pin.neutral(self._model)
        self._columns = {
            name: self._model.joints[self._model.getJointId(name)].idx_q
            for name in robot.joint_names
        }
        self._frames = [
            self._model.getFrameId(name, pin.FrameType.BODY)
            for name in (robot.torso_frame, *robot.sole_frames, *links)
        ]

    def at(self, names: Sequence[str], position: Sequence[float]) -> tuple[FloatArray, FloatArray]:
        """Return the poses of links (l, 4, 4) and soles (2, 4, 4) in the torso frame.

        Args:
            names: Names of the joints; unknown ones are ignored.
            position: Their angles [rad]; those that are not finite are ignored.
        """
        for name, angle in zip(names, position, strict=False):
            column = self._columns.get(name)
            if column is not None and np.isfinite(angle):
                self._q[column] = angle
        pin.framesForwardKinematics(self._model, self._data, self._q)
        poses = np.array([self._data.oMf[frame].homogeneous for frame in self._frames])
        in_torso = inverse_pose(poses[0]) @ poses[1:]
        return in_torso[2:], in_torso[:2]

    def com(self) -> FloatArray:
        """(3,) [m] CoM in the torso frame, for the angles of the last `at`."""
        com = pin.centerOfMass(self._model, self._data, self._q, False)
        return np.asarray(self._data.oMf[self._frames[0]].actInv(com))


def follow_body(
    walk: RecordedWalk, robot: RobotDescription, links: tuple[str, ...] = (), every: int = 1
) -> BodyTrack:
    """Compute the poses of the body from the recorded joint states.

    The torso is at its true pose; without ground truth it is placed by odometry, with the lower
    sole flat on the ground.
    """
    stamps = walk.position.stamp[::every]
    count = len(stamps)
    poses = LinkPoses(robot, links)
    link_in_torso = np.empty((count, len(links), 4, 4))
    sole_in_torso = np.empty((count, 2, 4, 4))
    com_in_torso = np.empty((count, 3))
    for row, angles in enumerate(walk.position.value[::every].tolist()):
        link_in_torso[row], sole_in_torso[row] = poses.at(walk.joint_names, angles)
        com_in_torso[row] = poses.com()
    from_truth = bool(len(walk.truth))
    if from_truth:
        true = walk.truth.at(stamps)
        torso = pose_of(true[:, 0:3], true[:, 3:7])
    else:
        odometry = walk.odometry.at(stamps) if len(walk.odometry) else np.zeros((count, 3))
        torso = torso_over_soles(odometry, sole_in_torso)
    return BodyTrack(
        stamp=stamps,
        torso=torso,
        sole=torso[:, None] @ sole_in_torso,
        com=np.einsum("tij,tj->ti", torso[:, :3, :3], com_in_torso) + torso[:, :3, 3],
        links=torso[:, None] @ link_in_torso,
        from_truth=from_truth,
    )


def yaw_of_pose(pose: FloatArray) -> FloatArray:
    """(...,) [rad] heading of the x axis of (..., 4, 4) poses."""
    return np.arctan2(pose[..., 1, 0], pose[..., 0, 0])


def inverse_pose(pose: FloatArray) -> FloatArray:
    """Inverse of (..., 4, 4) poses."""
    result = np.zeros_like(pose)
    result[..., :3, :3] = np.swapaxes(pose[..., :3, :3], -1, -2)
    result[..., :3, 3] = -np.einsum("...ij,...j->...i", result[..., :3, :3], pose[..., :3, 3])
    result[..., 3, 3] = 1.0
    return result


def pose_of(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    """(t, 4, 4) from (t, 3) [m] and (t, 4) xyzw."""
    x, y, z, w = quaternion.T
    pose = np.zeros((len(position), 4, 4))
    pose[:, 0, :3] = np.stack(
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1
    )
    pose[:, 1, :3] = np.stack(
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1
    )
    pose[:, 2, :3] = np.stack(
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1
    )
    pose[:, :3, 3] = position
    pose[:, 3, 3] = 1.0
    return pose


def torso_over_soles(odometry: FloatArray, sole_in_torso: FloatArray) -> FloatArray:
    """Pose of the torso in odom if its tilt is unknown.

    The lower sole is taken as flat on the ground; base_footprint is the middle between the soles.

    Args:
        odometry: (t, 3) x, y [m], yaw [rad] of base_footprint in odom.
        sole_in_torso: (t, 2, 4, 4) poses of the soles.

    Returns:
        (t, 4, 4).
    """
    # The lower sole of an upright torso; a walking robot is nearly upright.
    side = np.argmin(sole_in_torso[:, :, 2, 3], axis=1)
    torso_in_sole = inverse_pose(sole_in_torso[np.arange(len(side)), side])
    # base_footprint in the frame of the stance sole, inverted and placed by odometry.
    footprint = planar_pose(*footprint_of(torso_in_sole[:, None] @ sole_in_torso).T)
    return planar_pose(*odometry.T) @ inverse_pose(footprint) @ torso_in_sole


def footprint_of(soles: FloatArray) -> FloatArray:
    """(t, 3) x, y [m], yaw [rad] of the middle between soles (t, 2, 4, 4)."""
    heading = np.unwrap(yaw_of_pose(soles), axis=1).mean(axis=1)
    return np.column_stack([soles[:, :, :2, 3].mean(axis=1), heading])


def planar_pose(x: FloatArray, y: FloatArray, yaw: FloatArray) -> FloatArray:
    """(t, 4, 4) poses on the ground from x, y [m] and yaw [rad], each (t,)."""
    pose = np.zeros((len(x), 4, 4))
    pose[:, 0, 0] = pose[:, 1, 1] = np.cos(yaw)
    pose[:, 1, 0] = np.sin(yaw)
    pose[:, 0, 1] = -pose[:, 1, 0]
    pose[:, 2, 2] = pose[:, 3, 3] = 1.0
    pose[:, 0, 3], pose[:, 1, 3] = x, y
    return pose


ROUND = 12
"""Facets of a round shape around its axis."""


@dataclass(frozen=True, slots=True)
class Shapes:
    """The shapes of all links as one mesh of v vertices and f triangles.

    Attributes:
        links: Names.
        vertex: (v, 3) [m] in the frame of the link.
        link: (v,) index into `links`.
        triangle: (f, 3) indices of vertices.
        color: One per triangle, as #rrggbb.
    """

    links: tuple[str, ...]
    vertex: FloatArray
    link: IntArray
    triangle: IntArray
    color: tuple[str, ...]


def shapes_of(urdf: str) -> Shapes:
    """All visual boxes, cylinders and spheres of a URDF; meshes are left out."""
    root = ET.fromstring(urdf)
    colors = read_colors(root)
    links: list[str] = []
    vertices, owners, triangles, paint = [], [], [], []
    count = 0
    for link in root.findall("link"):
        for shape in read_shapes(link, "visual", pin.SE3.Identity(), colors):
            # Rounded, so that triangles share their corners.
            corners = mesh_of(shape, ROUND).vertices.round(9)
            points, corner = np.unique(corners, axis=0, return_inverse=True)
            faces = corner.reshape(-1, 3)
            name = link.get("name", "")
            if name not in links:
                links.append(name)
            vertices.append(points)
            owners.append(np.full(len(points), links.index(name)))
            triangles.append(faces + count)
            red, green, blue = (round(255 * value) for value in shape.color[:3])
            paint += [f"#{red:02x}{green:02x}{blue:02x}"] * len(faces)
            count += len(points)
    if not vertices:
        return Shapes((), np.empty((0, 3)), np.empty(0, int), np.empty((0, 3), int), ())
    return Shapes(
        tuple(links),
        np.vstack(vertices),
        np.concatenate(owners),
        np.vstack(triangles),
        tuple(paint),
    )
