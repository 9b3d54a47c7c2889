"""Learns the lasting tilt of a robot's cameras from objects of known size.

Encoders and IMU of a robot have constant errors, and a tilt of the camera moves a place at 3 m by
33 cm per degree. The size of a ball or post gives its distance without the tilt. A Kalman filter
estimates three constant angles from the differences:

    tilt = head + pitch cos(bearing) - roll sin(bearing)

head is the error of the neck, pitch and roll those of the torso.
"""

from math import cos, sin

import numpy as np

from nao_soccer.vision.image_geometry import PoseError, Tilt, bearing_of, lowered
from robot_core.robot.camera import CameraView
from robot_core.types import FloatArray

DRIFT = 1e-5
"""[rad] Standard deviation by which each angle changes from one observation to the next."""


class TiltCalibration:
    """The lasting tilt of one robot, shared by its cameras; its first error is `mounting`."""

    def __init__(self, error: PoseError) -> None:
        self._error = error
        self._angles = np.zeros(3)
        self._covariance = np.eye(3) * error.mounting**2 / 2.0

    def correct(self, view: CameraView) -> CameraView:
        """The camera with what is known of its tilt taken out."""
        return lowered(view, float(_design(bearing_of(view)) @ self._angles))

    def error_at(self, view: CameraView) -> PoseError:
        """Standard deviations of the corrected camera."""
        design = _design(bearing_of(view))
        lasting = float(design @ self._covariance @ design)
        return self._error.replace(tilt=float(np.sqrt(self._error.tilt**2 + lasting)))

    def learn(self, seen: Tilt) -> None:
        """Use one observation of what is left of the tilt."""
        design = _design(seen.bearing)
        self._covariance += np.eye(3) * DRIFT**2
        gain = self._covariance @ design
        variance = float(design @ gain) + seen.variance + self._error.tilt**2
        self._angles = self._angles + gain / variance * seen.angle
        self._covariance = self._covariance - np.outer(gain, gain) / variance


def _design(bearing: float) -> FloatArray:
    return np.array((1.0, cos(bearing), -sin(bearing)))
