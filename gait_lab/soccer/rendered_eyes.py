"""Percepts from rendered images, in the process of the simulation."""

import contextlib
from collections.abc import Callable, Sequence

import numpy as np

from gait_lab.soccer.percept_model import OtherRobot
from nao_lipm_gait.gait import Gait
from nao_soccer.vision.colors import load_color_table
from nao_soccer.vision.controller import ImageInput, VisionController
from nao_soccer.vision.percepts import Percepts
from nao_soccer.vision.settings import VisionSettings
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_from_rpy
from robot_core.types import Point2, SensorFrame
from sim_bridge.cameras.camera import CameraImage
from sim_bridge.robot import GroundTruth, SimulatedRobot

Deliver = Callable[[str, CameraImage], CameraImage | None]


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
        self._robot, self._gait = robot, gait
        self._deliver = deliver or (lambda _, image: image)
        self._vision = VisionController(robot.description, load_color_table("pitch"), settings)
        for camera in robot.cameras:
            self._vision.set_camera(camera.name, camera.model.intrinsics)
        self._names = list(robot.description.joint_names)
        self._seen: dict[str, int] = {}
        self._frame: SensorFrame | None = None
        self._stamp: int | None = None

    def arrived(
        self,
        now: int,
        truth: GroundTruth,
        ball: Point2,
        others: Sequence[OtherRobot],
    ) -> list[Percepts]:
        """See `Eyes`; the truth is not looked at."""
        # The gait has answered the newest frame or, within a control period, the one before.
        frames = self._frame, self._robot.sense()
        self._frame = frames[1]
        for frame in frames:
            if frame is not None and frame.stamp == self._gait.status.stamp != self._stamp:
                self._stamp = frame.stamp
                torso = self._gait.torso_pose
                self._vision.add_joints(frame.stamp, self._names, frame.joint_position)
                rotation = np.array(rotation_from_rpy(*torso[3:]))
                self._vision.add_torso(frame.stamp, np.array(torso[:3]), rotation)
        found = []
        for camera in self._robot.cameras:
            newest = camera.newest(now)
            image = None if newest is None else self._deliver(camera.name, newest)
            if image is not None and self._seen.get(camera.name) != image.stamp:
                self._seen[camera.name] = image.stamp
                height, width, _ = image.pixels.shape
                pixels = image.pixels.tobytes()
                message = ImageInput(image.stamp, width, height, "rgb8", 3 * width, pixels)
                with contextlib.suppress(NaoGaitError):  # it replaces one that waits for too long
                    self._vision.add_image(camera.name, message)
            with contextlib.suppress(NaoGaitError):  # an image that cannot be used, as in the node
                percepts = self._vision.see(camera.name)
                if percepts is not None:
                    found.append(percepts)
        return found
