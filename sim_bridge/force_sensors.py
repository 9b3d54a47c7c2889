"""The four force sensors of a sole."""

from collections.abc import Sequence

import numpy as np

from nao_lipm_gait.types import FloatArray, Point2


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
