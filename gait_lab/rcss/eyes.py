"""The server's `See` as percepts of a vision that errs, misses and is late as the measured one.

The server tells distance and direction of everything in 120 x 120 degrees, exactly, at once and by
name. The camera's pose is the robot's own estimate, as in a real vision; `exact` leaves out all
other errors.
"""

import math

import attrs
import numpy as np

from gait_lab.channel import Channel
from gait_lab.rcss.field import ServerField
from gait_lab.soccer.percept_model import ErrorModel
from gait_lab.vision.percept_errors import ROBOT, load_percept_errors
from nao_soccer.vision.image_geometry import ImageGeometry
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.vision.visible_ground import visible_ground
from rcss_bridge.codec import Polar, SeenPlayer, Sight
from robot_core.geometry import as_point, rotation_from_rpy
from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraModel, CameraPose, CameraView, Intrinsics
from robot_core.types import FloatArray, Pose6

IMAGE = Intrinsics.from_fov(1920, 1920, math.radians(120.0))
"""The server's camera; its resolution is chosen."""
MEASURED_FOCAL, OBJECTS = 361.0, 2.0
"""[px] of the images on which the errors were measured; size of the server's ball, lines and goals
over those in these images. A thing that is as large in the image is found as often."""
_ERRORS_OF = {
    "l": Kind.CROSSING_L, "t": Kind.CROSSING_T, "x": Kind.CROSSING_X, "p": Kind.CROSSING_X,
    "g": Kind.GOAL_POST,
}  # fmt: skip
"""Whose errors a landmark has, by the first letter of its name."""


class ServerEyes:
    """The vision of one robot.

    Attributes:
        places: Which pole on the map each landmark is; see `ServerField.places`.
    """

    def __init__(
        self, robot: RobotDescription, field: ServerField, team: str, number: int,
        *, exact: bool, seed: int = 0,
    ) -> None:  # fmt: skip
        errors = load_percept_errors()
        reach = IMAGE.fx / MEASURED_FOCAL * OBJECTS / field.size
        errors = attrs.evolve(errors, distances=tuple(reach * each for each in errors.distances))
        self._model = None if exact else ErrorModel(errors, seed)
        self._delay = 0 if exact else round(errors.delay * 1e9)
        self._camera = CameraModel(robot, next(iter(robot.cameras)), IMAGE)
        self.places = field.places(right=False)
        self._size = field.size
        self._team, self._number = team, number
        self._coming = Channel[Percepts]()

    def look(self, stamp: int, sight: Sight, joints: FloatArray, torso: Pose6) -> None:
        """Take what the server shows at a stamp [ns], with the torso [m, rad] in base_footprint."""
        rotation = np.array(rotation_from_rpy(*torso[3:]))
        position, turn = self._camera.in_torso(joints).under(np.array(torso[:3]), rotation)
        view = CameraView(IMAGE, CameraPose(position / self._size, turn))
        common = None if self._model is None else self._model.image(stamp)
        geometry = ImageGeometry(view)

        def percepts(kind: Kind, errors: str, seen: list[Polar]) -> list[tuple[Percept, int]]:
            """What is found of some things, and which."""
            if not seen:
                return []
            places = _places(seen, view, self._size)
            rows: FloatArray = np.column_stack((places, np.arange(float(len(places)))))
            if self._model is not None and common is not None:
                all_seen = np.ones(len(places), dtype=bool)
                rows = self._model.found(errors, places, all_seen, common)
            covariances = geometry.covariance(rows[:, :2])
            return [
                (Percept(kind, (x, y), as_point(covariance)), int(index))
                for (x, y, index), covariance in zip(rows.tolist(), covariances, strict=True)
            ]

        objects: list[Percept] = []
        for letter, errors in _ERRORS_OF.items():
            names = [each for each in sight.marks if each[0] == letter and each in self.places]
            found = percepts(Kind.POLE, errors.value, [sight.marks[each] for each in names])
            objects += [each._replace(place=self.places[names[index]]) for each, index in found]
        itself = self._team, self._number
        others = [each for each in sight.players if (each.team, each.number) != itself]
        for mate, kind in ((True, Kind.ROBOT_RED), (False, Kind.ROBOT_BLUE)):
            team = [each for each in others if (each.team == self._team) is mate]
            objects += [each for each, _ in percepts(kind, ROBOT, [_middle(one) for one in team])]
        ball = percepts(Kind.BALL, Kind.BALL.value, [] if sight.ball is None else [sight.ball])
        found_ball = ball[0][0] if ball else None
        recognised = Percepts(stamp, found_ball, tuple(objects), visible=visible_ground(view))
        self._coming.send(stamp + self._delay, recognised)

    def arrived(self, now: int) -> list[Percepts]:
        """What has been recognised by `now` [ns]."""
        return self._coming.receive(now)


def _places(seen: list[Polar], view: CameraView, size: float) -> FloatArray:
    """(n, 2) places on the ground in base_footprint, in lengths over `size`."""
    d, a, e = np.array(seen).T
    # In the optical frame: x to the right, y down, z ahead.
    rays = np.column_stack((-np.cos(e) * np.sin(a), -np.sin(e), np.cos(e) * np.cos(a)))
    points = view.pose.position + (d / size)[:, None] * rays @ view.pose.rotation.T
    places: FloatArray = points[:, :2]
    return places


def _middle(player: SeenPlayer) -> Polar:
    """Where a player stands: at one of its feet, or below its head."""
    parts = player.parts
    return parts.get("lfoot") or parts.get("rfoot") or next(iter(parts.values()))
