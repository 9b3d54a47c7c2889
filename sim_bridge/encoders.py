"""Joint angles as the robot reads them."""

import math

import numpy as np

from nao_lipm_gait.signals import FloatArray
from sim_bridge.individual import Individual
from sim_bridge.plant import Plant


class Encoders:
    """One encoder per joint, with its zero error, in steps."""

    def __init__(self, plant: Plant, individual: Individual) -> None:
        self._zero = individual.joint_zero
        bits = plant.sensors.encoder_bits
        self._step = 2.0 * math.pi / 2**bits if bits else 0.0
        self._steps = 2**bits / (2.0 * math.pi)

    def read(self, angle: FloatArray) -> FloatArray:
        """(n,) [rad] for true angles (n,) [rad]."""
        reading = angle - self._zero
        if self._step:
            reading *= self._steps
            reading = np.rint(reading, out=reading) * self._step
        return reading
