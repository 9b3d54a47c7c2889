"""Between a message and an image: checks what arrives, places each camera at the image's time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nao_soccer.vision.colors import ColorTable, Image
from nao_soccer.vision.debug_image import draw_debug_image
from nao_soccer.vision.detector import Vision
from nao_soccer.vision.percepts import Percepts
from nao_soccer.vision.pose_history import BodyHistory
from nao_soccer.vision.settings import VisionSettings
from nao_soccer.vision.tilt_calibration import TiltCalibration
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraModel, CameraPose, Intrinsics
from robot_core.types import FloatArray

ENCODINGS: Mapping[str, tuple[int, int, int] | None] = {"rgb8": None, "bgr8": (2, 1, 0)}
"""Encodings that are understood, and the order of red, green and blue where it differs."""
FOCAL_RANGE = (0.1, 20.0)
"""Smallest and largest focal length, of the width of the image."""
SIZE_MIN, SIZE_MAX = 32, 4096
"""[px] Smallest and largest width or height."""
DARK = 8.0
"""Mean brightness, of 255, below which an image shows nothing."""
MOVED, TURNED = 0.03, math.radians(2.0)
"""[m, rad] by which a camera moves until its image must have changed."""


@dataclass(frozen=True, slots=True)
class ImageInput:
    """Contents of an image message.

    Attributes:
        stamp: Time of the exposure [ns].
        width: Columns.
        height: Rows.
        encoding: As in `ENCODINGS`.
        step: Bytes of a row.
        data: The pixels.
    """

    stamp: int
    width: int
    height: int
    encoding: str
    step: int
    data: bytes


class _Still(NamedTuple):
    """The first of equal images of a camera, and where the camera was."""

    data: bytes
    pose: CameraPose


class VisionController:
    """Takes joints, torso poses, camera facts and images; returns percepts.

    `cameras` None = all of the robot; `images`: topic of the images below that of a camera.
    """

    def __init__(
        self,
        robot: RobotDescription,
        table: ColorTable,
        settings: VisionSettings,
        cameras: tuple[str, ...] | None = None,
        images: str = "image_raw",
    ) -> None:
        self._images = images
        self.cameras = tuple(robot.cameras) if cameras is None else cameras
        for name in self.cameras:
            if name not in robot.cameras:
                allowed = f"one of {', '.join(robot.cameras) or 'none: the robot has no camera'}"
                raise NaoGaitError("cameras", name, allowed)
        self._robot = robot
        self._table = table
        self._settings = settings
        self._history = BodyHistory()
        self._calibration = TiltCalibration(settings.error)
        self._models: dict[str, CameraModel] = {}
        self._visions: dict[str, Vision] = {}
        self._waiting: dict[str, ImageInput] = {}
        self._still: dict[str, _Still] = {}

    # -- body --------------------------------------------------------------------------------------

    def add_joints(self, stamp: int, names: list[str], position: FloatArray) -> None:
        """Joint angles by name at a time [ns].

        Raises:
            NaoGaitError: A joint of the robot is missing or its angle is not finite.
        """
        by_name = dict(zip(names, position, strict=False))
        missing = [name for name in self._robot.joint_names if name not in by_name]
        if missing:
            raise NaoGaitError("joint_states name", f"no {', '.join(missing)}", "all joints")
        angles = np.array([by_name[name] for name in self._robot.joint_names], dtype=float)
        if not np.isfinite(angles).all():
            raise NaoGaitError("joint_states position", angles.tolist(), "finite angles [rad]")
        self._history.add_joints(stamp, angles)

    def add_torso(self, stamp: int, position: FloatArray, rotation: FloatArray) -> None:
        """Torso in base_footprint at a time [ns]: (3,) [m] and (3, 3).

        Raises:
            NaoGaitError: A value is not finite.
        """
        if not (np.isfinite(position).all() and np.isfinite(rotation).all()):
            raise NaoGaitError("gait/torso_pose", position.tolist(), "finite numbers")
        self._history.add_torso(stamp, position, rotation)

    # -- cameras -----------------------------------------------------------------------------------

    def set_camera(self, camera: str, intrinsics: Intrinsics) -> None:
        """Facts of a camera, from `camera_info`; an image that waits is dropped if they change.

        Raises:
            NaoGaitError: A value is not usable.
        """
        known = self._models.get(camera)
        if known is not None and known.intrinsics == intrinsics:
            return
        width = intrinsics.width
        for name, size in (("width", width), ("height", intrinsics.height)):
            if not SIZE_MIN <= size <= SIZE_MAX:
                allowed = f"{SIZE_MIN} to {SIZE_MAX} px"
                raise NaoGaitError(f"{camera}/camera_info {name}", size, allowed)
        low, high = (each * width for each in FOCAL_RANGE)
        for name, focal in (("fx", intrinsics.fx), ("fy", intrinsics.fy)):
            if not low <= focal <= high:
                allowed = f"{low:g} to {high:g} px"
                raise NaoGaitError(f"{camera}/camera_info {name}", focal, allowed)
        centers = (("cx", intrinsics.cx, width), ("cy", intrinsics.cy, intrinsics.height))
        for name, center, size in centers:
            if not 0.0 <= center <= size:
                allowed = f"0 to {size} px: a centre inside the image"
                raise NaoGaitError(f"{camera}/camera_info {name}", center, allowed)
        self._waiting.pop(camera, None)
        self._models[camera] = CameraModel(self._robot, camera, intrinsics)
        self._visions[camera] = Vision(self._table, self._settings, self._calibration)

    def add_image(self, camera: str, image: ImageInput) -> None:
        """An image, which waits until the body at its time is known.

        Raises:
            NaoGaitError: The image is not usable, or replaces one that still waits.
        """
        pixels_of(f"{camera}/{self._images}", image)
        model = self._models.get(camera)
        if model is None:
            allowed = f"{camera}/camera_info before the first image"
            raise NaoGaitError(f"{camera}/{self._images}", "no camera_info", allowed)
        pinhole = model.intrinsics
        if (image.width, image.height) != (pinhole.width, pinhole.height):
            raise NaoGaitError(
                f"{camera}/{self._images} size",
                f"{image.width} x {image.height}",
                f"{pinhole.width} x {pinhole.height}, as in camera_info",
            )
        before = self._waiting.get(camera)
        self._waiting[camera] = image
        if before is not None:
            self._history.at(before.stamp)

    def see(self, camera: str) -> Percepts | None:
        """Percepts of the waiting image of a camera; None if there is none or it still waits.

        Raises:
            NaoGaitError: The body at the time of the image is not known any more, the image is
                black, or the camera repeats an old one; it is dropped.
        """
        image = self._waiting.get(camera)
        if image is None or not self._history.covers(image.stamp):
            return None
        del self._waiting[camera]
        body = self._history.at(image.stamp)
        view = self._models[camera].view(
            body.joint_position, body.torso_position, body.torso_rotation
        )
        where = f"{camera}/{self._images}"
        pixels = pixels_of(where, image)
        self._check_lively(camera, image.data, view.pose)
        brightness = float(pixels.mean())
        if brightness < DARK:
            raise NaoGaitError(f"{where} brightness", f"{brightness:.1f}", f"at least {DARK:g}")
        return self._visions[camera].see(image.stamp, pixels, view)

    def _check_lively(self, camera: str, data: bytes, pose: CameraPose) -> None:
        """Raise NaoGaitError if the image is an old one although the camera has moved since."""
        still = self._still.get(camera)
        if still is None or still.data != data:
            self._still[camera] = _Still(data, pose)
            return
        moved = float(np.linalg.norm(pose.position - still.pose.position))
        turned = 0.5 * (float(np.trace(still.pose.rotation.T @ pose.rotation)) - 1.0)
        if moved > MOVED or turned < math.cos(TURNED):
            allowed = "an image that changes with the camera's place"
            raise NaoGaitError(f"{camera}/{self._images} data", "the same image again", allowed)

    def debug_image(self, camera: str, percepts: Percepts) -> Image | None:
        """The last image of a camera with its percepts drawn into it; None before the first."""
        frame = self._visions[camera].frame
        return None if frame is None else draw_debug_image(frame, percepts)


def pixels_of(where: str, image: ImageInput) -> Image:
    """The pixels (height, width, 3); NaoGaitError if the message on a topic contradicts itself."""
    if image.encoding not in ENCODINGS:
        raise NaoGaitError(f"{where} encoding", image.encoding, ENCODINGS)
    if image.step < 3 * image.width:
        raise NaoGaitError(f"{where} step", image.step, f"at least {3 * image.width} bytes")
    size = image.step * image.height
    if len(image.data) != size or size == 0:
        raise NaoGaitError(f"{where} data", f"{len(image.data)} bytes", f"{size} bytes, over 0")
    rows = np.frombuffer(image.data, dtype=np.uint8).reshape(image.height, image.step)
    pixels = rows[:, : 3 * image.width].reshape(image.height, image.width, 3)
    order = ENCODINGS[image.encoding]
    return pixels if order is None else np.ascontiguousarray(pixels[..., order])
