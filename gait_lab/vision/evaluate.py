"""Renders one walk and scores what vision sees in it."""

import time
from dataclasses import dataclass, field, replace

import numpy as np

from gait_lab.vision.expected import View
from gait_lab.vision.observations import Observation, observations
from gait_lab.vision.score import Score, score_image
from gait_lab.vision.viewing_walks import random_walk
from nao_soccer.vision.colors import ColorTable, load_color_table
from nao_soccer.vision.detector import Vision
from nao_soccer.vision.settings import VisionSettings, settings_of_scene
from nao_soccer.vision.tilt_calibration import TiltCalibration
from robot_core.robot import load_robot
from sim_bridge.plant import PlantOption

BRIGHTNESS = (0.6, 1.0, 1.4)
"""Factors on each image, beside the exposure that each camera has of its own."""
SETTLE = 1.0
"""[s] At the start, in which vision learns the tilt of the cameras and nothing is scored."""


@dataclass(frozen=True, slots=True)
class VisionWalk:
    """One walk to be seen.

    Attributes:
        seed: Number of the robot.
        kind: One of `walks.KINDS`.
        engine: Of physics and images.
        seconds: Time that is scored.
        urdf: The robot.
        plant: Name or file of the plant.
        plant_options: Replaced options of the plant.
        clutter: Coloured columns stand around the field.
    """

    seed: int
    kind: str
    engine: str
    seconds: float
    urdf: str
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    clutter: bool = False


@dataclass(slots=True)
class WalkScores:
    """Scores of one walk.

    Attributes:
        walk: The walk.
        scores: By brightness.
        late: At brightness 1, with the newest pose of the camera in place of that of the image.
    """

    walk: VisionWalk
    scores: dict[float, Score]
    late: Score = field(default_factory=Score)


class _Viewer:
    """Vision with one brightness, over all images of a walk."""

    def __init__(
        self, table: ColorTable, settings: VisionSettings, brightness: float, *, late: bool = False
    ) -> None:
        self._table, self._settings = table, settings
        self._brightness, self._late = brightness, late
        self._calibration = TiltCalibration(settings.error)
        self._visions: dict[str, Vision] = {}
        self.score = Score()

    def see(self, seen: Observation, truth: View) -> None:
        """Look at one image, and score it after `SETTLE`."""
        vision = self._visions.setdefault(
            seen.camera, Vision(self._table, self._settings, self._calibration)
        )
        image = seen.image
        if self._brightness != 1.0:
            image = np.clip(image * self._brightness, 0, 255).astype(np.uint8)
        began = time.thread_time()
        percepts = vision.see(seen.stamp, image, seen.late_view if self._late else seen.view)
        seconds = time.thread_time() - began
        if vision.frame is not None and seen.stamp >= SETTLE * 1e9:
            geometry = vision.frame.geometry
            self.score.add(score_image(seen.truth, truth, percepts, geometry, seconds))


def evaluate_walk(walk: VisionWalk) -> WalkScores:
    """Render one walk and score it; each image is seen with every brightness."""
    seconds = SETTLE + walk.seconds
    spec = random_walk(
        walk.seed, walk.kind, walk.engine, seconds, walk.urdf, clutter=walk.clutter
    )
    spec = replace(spec, plant=walk.plant, plant_options=walk.plant_options)
    settings, table = settings_of_scene("pitch"), load_color_table("pitch")
    viewers = {factor: _Viewer(table, settings, factor) for factor in BRIGHTNESS}
    late = _Viewer(table, settings, 1.0, late=True)
    for seen in observations(spec, load_robot(walk.urdf)):
        truth = View(seen.truth, settings, spec.teams)
        for viewer in (*viewers.values(), late):
            viewer.see(seen, truth)
    scores = {factor: viewer.score for factor, viewer in viewers.items()}
    return WalkScores(walk, scores, late.score)
