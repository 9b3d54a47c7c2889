"""Percepts of one image after the other: the detectors in a straight line."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.ball import find_ball
from nao_soccer.vision.circle import find_circle
from nao_soccer.vision.colors import YELLOW, ColorClassifier, ColorTable, Image
from nao_soccer.vision.crossings import find_crossings
from nao_soccer.vision.frame import Frame, make_frame
from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.lines import find_segments
from nao_soccer.vision.percepts import Box, Kind, Percept, Percepts
from nao_soccer.vision.posts import find_uprights, uprights_of
from nao_soccer.vision.robots import find_robots, find_torsos
from nao_soccer.vision.scan_lines import LinePoints, bright, find_line_points
from nao_soccer.vision.settings import VisionSettings
from nao_soccer.vision.tilt_calibration import TiltCalibration
from nao_soccer.vision.visible_ground import visible_ground
from robot_core.robot.camera import CameraView

SEED = 1
"""Of the random samples, for each image anew: the same image gives the same percepts."""
MARGIN = 3
"""[px] Around posts and robots, where no line is searched."""


class Vision:
    """The detectors of one camera.

    Args:
        table: The colour classes.
        settings: What is looked for.
        calibration: Lasting tilt of the robot's cameras; None = it is not learned.

    Attributes:
        frame: The last image with its classes; None before the first.
    """

    def __init__(
        self,
        table: ColorTable,
        settings: VisionSettings,
        calibration: TiltCalibration | None = None,
    ) -> None:
        self.frame: Frame | None = None
        self._settings = settings
        self._calibration = calibration
        self._edge = table.edge
        self._uprights = uprights_of(settings)
        yellow = any(YELLOW in upright.colors for upright in self._uprights)
        self._classifier = ColorClassifier(table, yellow=yellow)

    def see(self, stamp: int, image: Image, view: CameraView) -> Percepts:
        """The percepts of an image (height, width, 3), red, green, blue, of a time [ns].

        `view` is the camera at that time, in base_footprint.
        """
        settings = self._settings
        calibration = self._calibration
        if calibration is None:
            geometry = ImageGeometry(view, settings.error)
        else:
            geometry = ImageGeometry(calibration.correct(view), calibration.error_at(view))
        frame = self.frame = make_frame(image, geometry, self._classifier)
        random = np.random.default_rng(SEED)
        torsos = find_torsos(frame)
        near = [each.box for each in torsos]
        ball = find_ball(frame, settings.ball_radius, near)
        uprights = find_uprights(frame, self._uprights, near)
        mask = bright(frame, self._edge)
        boxes = [each.box for each in uprights if each.box is not None]
        boxes += [each.reach for each in torsos]
        free = _free(mask.shape, boxes)
        points = find_line_points(frame, mask, free, self._edge, settings.field.line_width)
        circle = find_circle(frame, mask, points, 0.5 * settings.field.circle_diameter, random)
        straight = points
        objects = list(uprights)
        if circle is not None:
            # Its shape has shown the tilt of this image: the lines are placed with it.
            geometry = geometry.lowered(circle.tilt.angle)
            frame = self.frame = replace(frame, geometry=geometry)
            points = LinePoints(points.pixels, geometry.ground(points.pixels)[0])
            straight = LinePoints(points.pixels[~circle.on], points.places[~circle.on])
            a, b, c = geometry.covariance(np.array([circle.centre]))[0].tolist()
            objects.append(Percept(Kind.CENTRE_CIRCLE, circle.centre, (a, b, c)))
        width = settings.field.line_width
        segments = find_segments(frame, straight, random)
        objects += find_robots(frame, torsos, ball, segments, width)
        objects += find_crossings(frame, mask, segments, circle, free, width)
        if calibration is not None:
            for each in (ball, circle, *uprights):
                if each is not None and each.tilt is not None:
                    calibration.learn(each.tilt)
        return Percepts(
            stamp,
            ball,
            tuple(objects),
            points.places,
            geometry.covariance(points.places),
            tuple(segments),
            frame.boundary,
            visible_ground(geometry.view),
        )


def _free(shape: tuple[int, ...], boxes: list[Box]) -> NDArray[np.bool_]:
    """(height, width) false where one of the boxes is."""
    free = np.ones(shape, dtype=bool)
    for box in boxes:
        left, top, right, bottom = (int(value) for value in box)
        free[
            max(top - MARGIN, 0) : max(bottom + MARGIN + 1, 0),
            max(left - MARGIN, 0) : max(right + MARGIN + 1, 0),
        ] = False
    return free
