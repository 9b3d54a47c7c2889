"""What the gait does while sensors are missing: stop walking, or relax once it has fallen."""

from typing import NamedTuple

from nao_lipm_gait.runtime.frame_sync import MAX_IMU_AGE, FrameSync
from nao_lipm_gait.runtime.sole_loads import SoleLoads
from robot_core.types import GaitState

JOINT_PATIENCE = 300_000_000
"""[ns] without readable joints, after which the robot stops walking."""
LIGHT_TIME = 100_000_000
"""[ns] for which the soles must be light; longer than the flight phase of a walking robot."""
NO_LOAD = (GaitState.LIFTED, GaitState.GETTING_UP)
"""In these states soles without load do not mean a fall."""


class Outage(NamedTuple):
    """What to do about missing sensors in one tick.

    Attributes:
        reason: Why the robot must not walk; None if it may.
        log_key: Tells reasons apart; the log shows each once.
        fallen: The robot lies: take the torque off.
        imu_returned: The IMU is back after an outage.
    """

    reason: str | None = None
    log_key: str = ""
    fallen: bool = False
    imu_returned: bool = False


NO_OUTAGE = Outage()


class SensorOutage:
    """Decides once per tick whether the sensors are good enough to walk.

    Args:
        loads: The loads on the soles, which reveal a fall without an IMU.
        imu_patience: Time without an IMU [s] after which the robot stops walking.

    Attributes:
        blind: Time without an IMU at the last tick [ns].
    """

    def __init__(self, loads: SoleLoads, imu_patience: float) -> None:
        self._loads = loads
        self._patience = round(imu_patience * 1e9)
        self.blind = 0

    def assess(
        self, stamp: int, sync: FrameSync, unread_since: int | None, state: GaitState
    ) -> Outage:
        """Assess the sensors of one frame.

        Args:
            stamp: Stamp of the frame [ns].
            sync: Knows since when the IMU is missing.
            unread_since: Stamp since which joints cannot be read [ns]; None if they can.
            state: Of the gait.

        Returns:
            What to do.
        """
        before = self.blind
        self.blind = 0 if sync.blind_since is None else stamp - sync.blind_since + 1
        if self.blind > self._patience:
            lies = state is GaitState.FALLEN
            if lies or (state not in NO_LOAD and self._loads.light_time(stamp) >= LIGHT_TIME):
                why = "the robot lies" if lies else "the soles carry no load: relaxing"
                text = f"imu/data: none for {self.blind * 1e-9:.1f} s, and {why}"
                return Outage(text, "imu/data, fallen", fallen=True)
            return self._no_imu(sync.imu_behind)
        if self.blind == 0 and before > self._patience:
            self._loads.clear()
            return self._joints(stamp, unread_since)._replace(imu_returned=True)
        return self._joints(stamp, unread_since)

    def _no_imu(self, imu_behind: int | None) -> Outage:
        if imu_behind is None:
            text = f"imu/data: none for {self.blind * 1e-9:.1f} s; the robot stops"
            return Outage(text, "imu/data")
        side = "before" if imu_behind > 0 else "after"
        text = (
            f"imu/data header.stamp: {abs(imu_behind) * 1e-9:.3f} s {side} joint_states; "
            f"allowed: at most {MAX_IMU_AGE * 1e-9:g} s; the robot stops"
        )
        return Outage(text, "imu/data header.stamp")

    @staticmethod
    def _joints(stamp: int, unread_since: int | None) -> Outage:
        if unread_since is None or stamp - unread_since <= JOINT_PATIENCE:
            return NO_OUTAGE
        unread = (stamp - unread_since) * 1e-9
        reason = f"joint_states: none readable for {unread:.1f} s; the robot stops"
        return Outage(reason, "joint_states")
