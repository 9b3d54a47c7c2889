"""The eyes of a simulated robot: percepts by the model."""

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from gait_lab.channel import Channel
from gait_lab.soccer.percept_model import OtherRobot, PerceptModel
from gait_lab.vision.percept_errors import PerceptErrors
from nao_soccer.vision.percepts import Percepts
from robot_core.errors import NaoGaitError
from robot_core.field import Field, Goals
from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraModel, CameraView, Intrinsics
from robot_core.types import Point2, Pose2
from sim_bridge.robot import GroundTruth

IMAGE_SIZE = (320, 240)
"""[px]"""
IMAGE_PERIOD = 0.1
"""[s] between two images of a camera; the cameras expose one after the other."""


class Sight(NamedTuple):
    """What eyes look at by `time` [ns]; ball [m] and other robots are in the world."""

    time: int
    truth: GroundTruth
    ball: Point2
    others: Sequence[OtherRobot] = ()


class Eyes(Protocol):
    """The cameras of one robot and its vision."""

    def arrived(self, sight: Sight) -> list[Percepts]:
        """What is seen and known by now."""


def cameras_of(robot: RobotDescription) -> list[CameraModel]:
    """The cameras of a robot, with images of `IMAGE_SIZE`."""
    return [
        CameraModel(robot, name, Intrinsics.from_fov(*IMAGE_SIZE, camera.hfov))
        for name, camera in robot.cameras.items()
    ]


class ModelEyes:
    """Percepts by the model of their errors, without images."""

    def __init__(
        self,
        robot: RobotDescription,
        team: str,
        field: Field,
        goals: Goals,
        errors: PerceptErrors,
        seed: int,
    ) -> None:
        self._team = team
        self._model = PerceptModel(errors, field, goals, seed)
        self._delay = round(errors.delay * 1e9)
        self._cameras = cameras_of(robot)
        if not self._cameras:
            allowed = "a robot with `cameras` in its robot file"
            raise NaoGaitError("cameras", f"none on {robot.name}", allowed)
        self._period = round(IMAGE_PERIOD * 1e9) // len(self._cameras)
        self._next_image = 0
        self._camera = 0
        self._coming = Channel[Percepts]()

    def arrived(self, sight: Sight) -> list[Percepts]:
        """See `Eyes`."""
        now, truth, ball, others = sight
        if now >= self._next_image:
            self._next_image = now + self._period
            self._camera = (self._camera + 1) % len(self._cameras)
            footprint = truth.base_footprint
            percepts = self._model.see(
                now,
                _view(self._cameras[self._camera], truth, footprint),
                in_field(footprint, self._team),
                in_field((*ball, 0.0), self._team)[:2],
                [
                    each._replace(place=in_field((*each.place, 0.0), self._team)[:2])
                    for each in others
                ],
            )
            self._coming.send(now + self._delay, percepts)
        return self._coming.receive(now)


def _view(camera: CameraModel, truth: GroundTruth, footprint: Pose2) -> CameraView:
    """The camera in base_footprint, by the truth."""
    c, s = math.cos(footprint[2]), math.sin(footprint[2])
    turn = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)))
    place = turn @ (truth.torso_position - np.array((*footprint[:2], 0.0)))
    return camera.view(truth.joint_position, place, turn @ rotation_matrix(truth.torso_quaternion))


def in_field(pose: Pose2, team: str) -> Pose2:
    """A pose of the world in the field of a team, in which x points to the opponents' goal."""
    if team == "red":
        return pose
    return -pose[0], -pose[1], math.remainder(pose[2] + math.pi, math.tau)
