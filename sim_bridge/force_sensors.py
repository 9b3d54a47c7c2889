"""The four force sensors of a sole."""

from collections.abc import Sequence

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point2
from sim_bridge.individual import Individual, stream
from sim_bridge.plant import Plant

Wrenches = tuple[FloatArray, FloatArray]
"""Of the left and the right sole."""


class ForceSensorModel:
    """The force sensors of a robot, with the errors of the individual."""

    def __init__(
        self, robot: RobotDescription, plant: Plant, individual: Individual, noise_seed: int
    ) -> None:
        """Prepare the sensors.

        Args:
            robot: Places of the sensors.
            plant: Noise and dead zone.
            individual: Gains and offsets.
            noise_seed: Of the noise.

        Raises:
            NaoGaitError: The plant wants sensors that this robot does not have.
        """
        self._settings = plant.force_sensors
        self._places = robot.force_sensors
        self._individual = individual
        self._noise_seed = noise_seed
        if self._settings.four and robot.force_sensors is None:
            allowed = f"false: {robot.name} has no force sensors"
            raise NaoGaitError("force_sensors.four", True, allowed)
        self.restart()

    def restart(self) -> None:
        """Restart the noise, so that a run can be repeated."""
        self._noise = stream(self._noise_seed, "force_noise")

    def read(self, exact: Wrenches) -> Wrenches:
        """The wrenches (6,) [N], [N m] that the soles report for the exact ones."""
        places = self._places
        if not self._settings.four or places is None:
            return exact
        left, right = (
            wrench_of(self._loads(wrench, places[side], side), places[side])
            for side, wrench in enumerate(exact)
        )
        return left, right

    def _loads(self, wrench: FloatArray, places: Sequence[Point2], side: int) -> FloatArray:
        """(4,) [N] readings of the sensors of a sole."""
        settings, individual = self._settings, self._individual
        loads = individual.force_gain[side] * np.array(sole_loads(wrench, places))
        loads += individual.force_offset[side]
        if settings.noise > 0.0:
            loads += settings.noise * self._noise.standard_normal(4)
        read: FloatArray = np.where(loads < max(settings.dead_zone, 0.0), 0.0, loads)
        return read


def wrench_of(loads: FloatArray, places: Sequence[Point2]) -> FloatArray:
    """(6,) force [N] and torque [N m] about the sole's origin of normal forces (4,) [N]."""
    x, y = np.array(places).T
    return np.array((0.0, 0.0, loads.sum(), y @ loads, -(x @ loads), 0.0))


def sole_loads(wrench: FloatArray, places: Sequence[Point2]) -> list[float]:
    """Normal forces [N] on the four sensors: the smallest that give the wrench.

    None is negative; if the centre of pressure lies outside the sensors, the force is kept and the
    torques are met as well as possible.

    Args:
        wrench: (6,) force [N] and torque [N m] of the floor on the sole, about its origin.
        places: [m] of its sensors.
    """
    force = float(wrench[2])
    if force <= 0.0:
        return [0.0] * 4
    points = np.array(places)
    active = [0, 1, 2, 3]
    while True:
        x, y = points[active].T
        rows = np.vstack((np.ones(len(active)), y, -x))
        loads = np.linalg.lstsq(rows, np.array((force, wrench[3], wrench[4])), rcond=None)[0]
        if loads.min() >= 0.0 or len(active) == 1:
            break
        active.pop(int(loads.argmin()))
    loads = np.maximum(loads, 0.0) * (force / max(float(loads.sum()), 1e-9))
    found = [0.0] * 4
    for index, load in zip(active, loads.tolist(), strict=True):
        found[index] = load
    return found
