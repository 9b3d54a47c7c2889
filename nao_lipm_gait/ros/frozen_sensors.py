"""Sensors that go on sending and no longer measure.

A living IMU has noise, and the joints of a walking robot move: the same numbers again and again,
while other things change, come from a sensor that is stuck.
"""

import numpy as np

from nao_lipm_gait.signals import FloatArray

JOINT_REPEATS = 6
"""Equal joint samples in a row that no walking robot gives."""
IMU_REPEATS = 10
"""Equal IMU samples in a row, while joints move, that no living IMU gives."""
MOVED = 0.02
"""[rad] by which a joint moves while the IMU says the same."""


class FrozenSensors:
    """Watches the values, not the stamps."""

    def __init__(self) -> None:
        self._imu: tuple[object, object] | None = None
        self._imu_repeats = 0
        self._pose_then: FloatArray | None = None
        self._pose: FloatArray | None = None
        self._joint_repeats = 0

    def begin_anew(self) -> None:
        self.__init__()  # type: ignore[misc]

    def see_imu(self, rotation: tuple[float, ...], force: tuple[float, ...]) -> None:
        """One IMU sample."""
        values = (rotation, force)
        if values == self._imu:
            self._imu_repeats += 1
        else:
            self._imu, self._imu_repeats, self._pose_then = values, 0, self._pose

    def see_joints(self, position: FloatArray) -> None:
        """One joint sample (n,) [rad]."""
        same = self._pose is not None and bool((position == self._pose).all())
        self._joint_repeats = self._joint_repeats + 1 if same else 0
        self._pose = position

    @property
    def joints(self) -> bool:
        """Nothing moves: a robot at rest, or joints that are stuck."""
        return self._joint_repeats >= JOINT_REPEATS

    @property
    def imu(self) -> bool:
        """The IMU is stuck."""
        if self._imu_repeats < IMU_REPEATS or self._pose is None or self._pose_then is None:
            return False
        return float(np.max(np.abs(self._pose - self._pose_then))) > MOVED
