"""Single wrong numbers of a sensor: what cannot have changed so much is not believed at once."""

import numpy as np

from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.signals import FloatArray

SPEED_SHARE = 3.0
"""Of a joint's speed limit. Joints that are pushed, measured in steps of an encoder, reach 1.6."""
ROTATION_STEP = 4.0
"""[rad/s] from one gyro sample to the next. Pushes and falls reach 2."""
PATIENCE = 3
"""Samples in a row that are held; a fourth is believed: it is how things are now. Where there is
something better to believe, it is believed for as long as it takes."""


class StepFilter:
    """Holds the last believed values where new ones are further away than `step`."""

    def __init__(self) -> None:
        self._last: FloatArray | None = None
        self._held: FloatArray = np.zeros(0, dtype=int)

    def begin_anew(self) -> None:
        self._last = None

    def see(
        self, values: FloatArray, step: FloatArray | float, instead: FloatArray | None = None
    ) -> tuple[FloatArray, np.ndarray]:
        """The believed values (n,), and the indices of those that are held.

        Args:
            step: (n,) or one for all, the largest believable change.
            instead: (n,) what to believe in place of what is not believable; None = the last.
        """
        last = self._last
        if last is None or last.shape != values.shape:
            self._last, self._held = values, np.zeros(values.shape, dtype=int)
            return values, np.zeros(0, dtype=int)
        wild = np.abs(values - last) > step
        if not wild.any():
            if self._held.any():
                self._held[:] = 0
            self._last = values
            return values, np.zeros(0, dtype=int)
        hold = wild if instead is not None else wild & (self._held < PATIENCE)
        self._held = np.where(hold, self._held + 1, 0)
        believed = np.where(hold, last if instead is None else instead, values)
        self._last = believed
        return believed, np.flatnonzero(hold)


class SpikeFilter:
    """Joints and gyro, each by how fast they can change."""

    def __init__(self, robot: RobotDescription) -> None:
        self._speed = SPEED_SHARE * np.asarray(robot.velocity_limit, dtype=float)
        self._names = robot.joint_names
        self._joints = StepFilter()
        self._gyro = StepFilter()

    def begin_anew(self) -> None:
        self._joints.begin_anew()
        self._gyro.begin_anew()

    def joints(
        self, position: FloatArray, elapsed: float, told: FloatArray | None = None
    ) -> tuple[FloatArray, str | None]:
        """(n,) [rad] as believed, `elapsed` [s] after the last; a word about what is held.

        told: (n,) where the joints were told to be, None where they are not.
        """
        believed, held = self._joints.see(position, self._speed * elapsed, told)
        if not len(held):
            return believed, None
        worst = int(held[0])
        return believed, (
            f"joint_states position[{self._names[worst]}]: got {position[worst]:.3g} after "
            f"{believed[worst]:.3g}; allowed: {self._speed[worst]:.3g} rad/s; not believed"
        )

    def rotation(self, rate: FloatArray) -> tuple[FloatArray, str | None]:
        """(3,) [rad/s] as believed; a word about what is held."""
        believed, held = self._gyro.see(rate, ROTATION_STEP)
        if not len(held):
            return believed, None
        axis = int(held[0])
        return believed, (
            f"imu/data angular_velocity.{'xyz'[axis]}: got {rate[axis]:.3g} after "
            f"{believed[axis]:.3g}; allowed: steps of {ROTATION_STEP:g} rad/s; held for a moment"
        )
