"""Where a kick's spot is in the world, for a robot that stands."""

import math

import numpy as np

from gait_lab.analysis.metrics import yaw_of
from nao_lipm_gait.types import FloatArray
from sim_bridge.simulation import GroundTruth


def spot_in_world(truth: GroundTruth, x: float, y: float) -> FloatArray:
    """(2,) [m] in the world of a point seen from the middle between the soles, x along the heading
    of the torso.
    """
    heading = float(yaw_of(truth.torso_quaternion))
    middle = 0.5 * (truth.soles[0].position + truth.soles[1].position)[:2]
    cos, sin = math.cos(heading), math.sin(heading)
    return np.asarray(middle + np.array((cos * x - sin * y, sin * x + cos * y)))
