"""Renders a walk and scores what vision sees in it from where the robot measured its camera."""

import time
from dataclasses import dataclass, field

import numpy as np

from gait_lab.vision.expected import View
from gait_lab.vision.rendered_frames import RenderedFrame, RenderSpec, rendered_frames
from gait_lab.vision.score import Score, score_image
from nao_soccer.vision.colors import Image, load_color_table
from nao_soccer.vision.detector import Vision
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.percepts import Percepts
from nao_soccer.vision.settings import settings_of_scene
from nao_soccer.vision.tilt_calibration import TiltCalibration

BRIGHTNESS = (0.6, 1.0, 1.4)
"""Factors on each image, beside the exposure that each camera has of its own."""
SETTLE = 1.0
"""[s] At the start, in which vision learns the tilt of the cameras and nothing is scored."""


@dataclass(slots=True)
class WalkScores:
    """Scores of one walk.

    Attributes:
        scores: By brightness.
        late: At brightness 1, with the newest pose of the camera in place of that of the image.
    """

    scores: dict[float, Score]
    late: Score = field(default_factory=Score)


class Viewer:
    """Vision with one brightness, over all images of a walk on the pitch."""

    def __init__(self, brightness: float, *, late: bool = False) -> None:
        self.settings, self._table = settings_of_scene("pitch"), load_color_table("pitch")
        self._brightness, self._late = brightness, late
        self._calibration = TiltCalibration(self.settings.error)
        self._visions: dict[str, Vision] = {}
        self.image: Image = np.zeros((0, 0, 3), dtype=np.uint8)
        self.frame: Frame | None = None
        self.seconds = 0.0
        self.score = Score()

    def see(self, seen: RenderedFrame) -> Percepts:
        """Look at one image."""
        vision = self._visions.setdefault(
            seen.camera, Vision(self._table, self.settings, self._calibration)
        )
        self.image = seen.image
        if self._brightness != 1.0:
            self.image = np.clip(seen.image * self._brightness, 0, 255).astype(np.uint8)
        view = seen.late_view if self._late else seen.view
        began = time.thread_time()
        percepts = vision.see(seen.stamp, self.image, view)
        self.seconds = time.thread_time() - began
        self.frame = vision.frame
        return percepts

    def judge(self, seen: RenderedFrame, truth: View) -> None:
        """Look at one image, and score it after `SETTLE`."""
        percepts = self.see(seen)
        if self.frame is not None and seen.stamp >= SETTLE * 1e9:
            geometry = self.frame.geometry
            self.score.add(score_image(seen.truth, truth, percepts, geometry, self.seconds))


def evaluate_walk(spec: RenderSpec) -> WalkScores:
    """Render one walk and score it from `SETTLE` on; each image is seen with every brightness."""
    viewers = {factor: Viewer(factor) for factor in BRIGHTNESS}
    late = Viewer(1.0, late=True)
    teams = {robot.name: robot.team for robot in spec.scene.robots}
    for seen in rendered_frames(spec):
        truth = View(seen.truth, late.settings, teams)
        for viewer in (*viewers.values(), late):
            viewer.judge(seen, truth)
    scores = {factor: viewer.score for factor, viewer in viewers.items()}
    return WalkScores(scores, late.score)
