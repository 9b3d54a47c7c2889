"""Images of a walk with the camera's pose as the robot measured it, and the truth."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from nao_soccer.vision.pose_history import BodyHistory
from robot_core.geometry import rotation_from_rpy
from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraModel, CameraView, RgbImage
from sim_bridge.trials.rendered_frames import FrameTruth, RenderedFrame, RenderSpec, rendered_frames


class Observation(NamedTuple):
    """An image that vision can work on.

    Attributes:
        camera: Name of the camera.
        stamp: [ns] time of the exposure.
        time: [ns] when the image arrives.
        image: (h, w, 3) red, green, blue.
        view: The camera in base_footprint at the time of the exposure, as measured.
        late_view: The same from the newest measurement at the arrival of the image.
        truth: At the time of the exposure.
    """

    camera: str
    stamp: int
    time: int
    image: RgbImage
    view: CameraView
    late_view: CameraView
    truth: FrameTruth


def observations(spec: RenderSpec, robot: RobotDescription) -> Iterator[Observation]:
    """The images of a walk for whose time the body is known."""
    models: dict[str, CameraModel] = {}
    for frame in rendered_frames(spec):
        model = models.setdefault(frame.camera, CameraModel(robot, frame.camera, frame.intrinsics))
        history = _history(frame)
        if not history.covers(frame.stamp) or frame.samples[0].stamp > frame.stamp:
            continue
        view, late_view = (
            model.view(*history.at(stamp)) for stamp in (frame.stamp, frame.samples[-1].stamp)
        )
        yield Observation(
            frame.camera, frame.stamp, frame.time, frame.image, view, late_view, frame.truth
        )


def _history(frame: RenderedFrame) -> BodyHistory:
    """What the robot has measured of its body."""
    history = BodyHistory()
    for sample in frame.samples:
        x, y, z, roll, pitch, yaw = sample.torso_in_footprint
        history.add_joints(sample.stamp, sample.joint_position)
        rotation = np.array(rotation_from_rpy(roll, pitch, yaw))
        history.add_torso(sample.stamp, np.array((x, y, z)), rotation)
    return history
