"""The pinhole model of a camera, and where the cameras of a robot are.

Frames: z of an optical frame is the line of sight, x is to the right, y down (REP-103).
Pixels: u to the right, v down; (0, 0) is the centre of the first pixel, as in `CameraInfo` and
OpenCV. Arrays of points or pixels are (..., 3) and (..., 2).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robot_core.errors import NaoGaitError
from robot_core.robot.description import RobotDescription
from robot_core.types import FloatArray

RgbImage = NDArray[np.uint8]
"""(height, width, 3) red, green, blue; the first row is the upper one."""


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera without distortion.

    Attributes:
        width: Number of columns.
        height: Number of rows.
        fx: Focal length [px] along u.
        fy: Focal length [px] along v.
        cx: Column of the principal point [px].
        cy: Row of the principal point [px].
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def from_fov(cls, width: int, height: int, hfov: float) -> Self:
        """The camera with square pixels and its principal point in the middle of the image.

        Args:
            width: Number of columns.
            height: Number of rows.
            hfov: Horizontal angle of view [rad], between the outer edges of the image.
        """
        focal = 0.5 * width / math.tan(0.5 * hfov)
        return cls(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))

    def project(self, points: FloatArray) -> FloatArray:
        """Pixels (..., 2) of points (..., 3) [m] in the optical frame; NaN behind the camera."""
        points = np.asarray(points, dtype=float)
        depth = np.where(points[..., 2] > 0.0, points[..., 2], np.nan)
        pixels = np.empty((*depth.shape, 2))
        pixels[..., 0] = self.cx + self.fx * points[..., 0] / depth
        pixels[..., 1] = self.cy + self.fy * points[..., 1] / depth
        return pixels

    def rays(self, pixels: FloatArray) -> FloatArray:
        """Directions (..., 3) in the optical frame, of depth z = 1, of pixels (..., 2)."""
        pixels = np.asarray(pixels, dtype=float)
        x = (pixels[..., 0] - self.cx) / self.fx
        y = (pixels[..., 1] - self.cy) / self.fy
        return np.stack((x, y, np.ones_like(x)), axis=-1)

    def contains(self, pixels: FloatArray) -> NDArray[np.bool_]:
        """Whether pixels (..., 2) lie inside the image; false for NaN."""
        pixels = np.asarray(pixels, dtype=float)
        u, v = pixels[..., 0], pixels[..., 1]
        inside = (u >= -0.5) & (u < self.width - 0.5) & (v >= -0.5) & (v < self.height - 0.5)
        return np.asarray(inside)


class CameraPose(NamedTuple):
    """Pose of an optical frame in a reference frame.

    Attributes:
        position: (3,) [m]
        rotation: (3, 3), optical frame to reference frame.
    """

    position: FloatArray
    rotation: FloatArray

    def under(self, position: FloatArray, rotation: FloatArray) -> "CameraPose":
        """This camera in the frame in which its reference frame has the given pose.

        Args:
            position: (3,) [m] of the reference frame.
            rotation: (3, 3) of the reference frame.
        """
        return CameraPose(position + rotation @ self.position, rotation @ self.rotation)


def looking(place: FloatArray, at: FloatArray) -> CameraPose:
    """The upright optical frame at a place (3,) [m] that looks at a point (3,) [m]."""
    ahead = at - place
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    return CameraPose(place, np.column_stack((right, np.cross(ahead, right), ahead)))


@dataclass(frozen=True, slots=True)
class CameraView:
    """A camera at one instant: what it images, and from where.

    Attributes:
        intrinsics: The pinhole.
        pose: Pose of the optical frame in the reference frame.
    """

    intrinsics: Intrinsics
    pose: CameraPose

    def project(self, points: FloatArray) -> FloatArray:
        """Pixels (..., 2) of points (..., 3) [m] in the reference frame; NaN behind the camera."""
        position, rotation = self.pose
        return self.intrinsics.project((np.asarray(points, dtype=float) - position) @ rotation)

    def rays(self, pixels: FloatArray) -> FloatArray:
        """Directions (..., 3) in the reference frame of pixels (..., 2); their depth is 1."""
        rays: FloatArray = self.intrinsics.rays(pixels) @ self.pose.rotation.T
        return rays

    def on_plane(self, pixels: FloatArray, height: float = 0.0) -> FloatArray:
        """Points (..., 3) [m] in which the rays of pixels meet the plane z = height.

        NaN for pixels at or above the horizon of that plane.
        """
        rays = self.rays(pixels)
        drop = height - self.pose.position[2]
        ahead = rays[..., 2] * drop > 0.0
        reach = np.where(ahead, drop / np.where(ahead, rays[..., 2], 1.0), np.nan)
        points: FloatArray = self.pose.position + reach[..., None] * rays
        return points


class CameraModel:
    """One camera of a robot.

    Attributes:
        name: Name of the camera.
        frame: Link of the optical frame.
        intrinsics: The pinhole.
    """

    def __init__(self, robot: RobotDescription, name: str, intrinsics: Intrinsics) -> None:
        """Find the camera in the URDF.

        Args:
            robot: The robot.
            name: One of `robot.cameras`.
            intrinsics: The pinhole, as in `CameraInfo`.

        Raises:
            NaoGaitError: The robot has no such camera.
        """
        if name not in robot.cameras:
            allowed = ", ".join(robot.cameras) or f"none: {robot.urdf_path} has no camera"
            raise NaoGaitError("camera", name, allowed)
        self.name = name
        self.frame = robot.cameras[name].frame
        self.intrinsics = intrinsics
        self._model = pin.buildModelFromXML(robot.urdf)
        self._data = self._model.createData()
        self._q = pin.neutral(self._model)
        self._q_index = np.array(
            [self._model.joints[self._model.getJointId(each)].idx_q for each in robot.joint_names]
        )
        self._torso = self._model.getFrameId(robot.torso_frame, pin.FrameType.BODY)
        self._camera = self._model.getFrameId(self.frame, pin.FrameType.BODY)

    def in_torso(self, joint_position: FloatArray) -> CameraPose:
        """Pose of the camera in the torso frame at joint angles (n,) [rad]."""
        self._q[self._q_index] = joint_position
        pin.forwardKinematics(self._model, self._data, self._q)
        torso = pin.updateFramePlacement(self._model, self._data, self._torso)
        camera = torso.actInv(pin.updateFramePlacement(self._model, self._data, self._camera))
        return CameraPose(camera.translation.copy(), camera.rotation.copy())

    def view(
        self, joint_position: FloatArray, torso_position: FloatArray, torso_rotation: FloatArray
    ) -> CameraView:
        """The camera at one instant.

        Args:
            joint_position: (n,) [rad]
            torso_position: (3,) [m] of the torso in the reference frame.
            torso_rotation: (3, 3), torso to reference frame.
        """
        pose = self.in_torso(joint_position).under(torso_position, torso_rotation)
        return CameraView(self.intrinsics, pose)
