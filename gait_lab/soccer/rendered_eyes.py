"""Percepts from rendered images, in the process of the simulation."""

import contextlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gait_lab.soccer.eyes import Sight
from nao_lipm_gait.gait import Gait
from nao_soccer.vision.colors import load_color_table
from nao_soccer.vision.controller import ImageInput, VisionController
from nao_soccer.vision.percepts import Percepts
from nao_soccer.vision.settings import VisionSettings
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_from_rpy
from robot_core.robot.camera import RgbImage
from robot_core.types import FloatArray, Pose6, SensorFrame
from sim_bridge.cameras.camera import CameraImage
from sim_bridge.robot import SimulatedRobot

Deliver = Callable[[str, CameraImage], CameraImage | None]


class BodyAt(NamedTuple):
    """What a gait reported of its body: stamp [ns], joints [rad], torso in base_footprint."""

    stamp: int
    joints: FloatArray
    torso: Pose6


class BodyReports:
    """What the gait of a robot reports of its body, each frame once."""

    def __init__(self, robot: SimulatedRobot, gait: Gait) -> None:
        self._robot, self._gait = robot, gait
        self._frame: SensorFrame | None = None
        self.stamp = -1

    def newest(self) -> BodyAt | None:
        """The body at the frame that the gait has answered; None if that is known."""
        # The gait has answered the newest frame or, within a control period, the one before.
        frames = self._frame, self._robot.sense()
        self._frame = frames[1]
        for frame in frames:
            if frame is not None and frame.stamp == self._gait.status.stamp != self.stamp:
                self.stamp = frame.stamp
                return BodyAt(frame.stamp, frame.joint_position, self._gait.torso_pose)
        return None


class RobotVision:
    """Vision of a simulated robot, which drops images that cannot be used, as the node does."""

    def __init__(self, robot: SimulatedRobot, settings: VisionSettings) -> None:
        self._names = list(robot.description.joint_names)
        self._vision = VisionController(robot.description, load_color_table("pitch"), settings)
        for camera in robot.cameras:
            self._vision.set_camera(camera.name, camera.model.intrinsics)

    def add_body(self, body: BodyAt) -> None:
        """Take what the gait reported."""
        self._vision.add_joints(body.stamp, self._names, body.joints)
        rotation = np.array(rotation_from_rpy(*body.torso[3:]))
        self._vision.add_torso(body.stamp, np.array(body.torso[:3]), rotation)

    def add_image(self, camera: str, stamp: int, pixels: RgbImage) -> None:
        """Take an image (h, w, 3) of a stamp [ns]."""
        height, width, _ = pixels.shape
        image = ImageInput(stamp, width, height, "rgb8", 3 * width, pixels.tobytes())
        with contextlib.suppress(NaoGaitError):  # it replaces one that waits for too long
            self._vision.add_image(camera, image)

    def see(self, camera: str) -> Percepts | None:
        """Percepts of the waiting image of a camera; None = there is none, or not usable."""
        with contextlib.suppress(NaoGaitError):
            return self._vision.see(camera)
        return None


class RenderedEyes:
    """The simulated cameras of a robot, and its vision; see `Eyes`.

    `deliver` returns what arrives of the newest image of a camera; None = all.
    """

    def __init__(
        self,
        robot: SimulatedRobot,
        gait: Gait,
        settings: VisionSettings,
        deliver: Deliver | None = None,
    ) -> None:
        self._cameras = robot.cameras
        self._deliver = deliver or (lambda _, image: image)
        self._vision = RobotVision(robot, settings)
        self._body = BodyReports(robot, gait)
        self._seen: dict[str, int] = {}

    def arrived(self, sight: Sight) -> list[Percepts]:
        """See `Eyes`; the truth is not looked at."""
        body = self._body.newest()
        if body is not None:
            self._vision.add_body(body)
        found = []
        for camera in self._cameras:
            newest = camera.newest(sight.time)
            image = None if newest is None else self._deliver(camera.name, newest)
            if image is not None and self._seen.get(camera.name) != image.stamp:
                self._seen[camera.name] = image.stamp
                self._vision.add_image(camera.name, image.stamp, image.pixels)
            percepts = self._vision.see(camera.name)
            if percepts is not None:
                found.append(percepts)
        return found
