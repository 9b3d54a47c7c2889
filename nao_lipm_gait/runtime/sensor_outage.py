"""What the gait does while sensors are missing: stop walking, or relax once it has fallen."""

from typing import NamedTuple

from nao_lipm_gait.runtime.frame_sync import MAX_IMU_AGE, FrameSync
from nao_lipm_gait.types import GRAVITY

JOINT_PATIENCE = 300_000_000
"""[ns] without readable joints, after which the robot stops walking."""
LIGHT_SHARE = 0.3
"""Share of the robot's weight; with less on both soles they do not carry the robot."""
LIGHT_TIME = 100_000_000
"""[ns] for which the soles must be light; longer than the flight phase of a walking robot."""
LOAD_AGE = 300_000_000
"""[ns] Older loads are not used."""


class SoleLoads:
    """Tells from the normal forces whether the soles still carry the robot.

    Used only while the IMU is missing, which otherwise detects a fall.

    Args:
        mass: Mass of the robot [kg].
    """

    def __init__(self, mass: float) -> None:
        self._least = LIGHT_SHARE * mass * GRAVITY
        self.clear()

    def clear(self) -> None:
        """Forget all loads."""
        self._force: list[tuple[int, float] | None] = [None, None]
        self._light_since: int | None = None

    def add(self, side: int, stamp: int, force: float) -> None:
        """Keep a load.

        Args:
            side: 0 left, 1 right.
            stamp: [ns].
            force: Along the normal of the sole [N].
        """
        self._force[side] = stamp, force
        left, right = self._force
        if left is None or right is None:
            return
        light = left[1] + right[1] < self._least
        if not light:
            self._light_since = None
        elif self._light_since is None:
            self._light_since = stamp

    def are_light(self, stamp: int) -> bool:
        """Whether the soles have not carried the robot for some time at `stamp` [ns]."""
        since = self._light_since
        known = all(each is not None and stamp - each[0] < LOAD_AGE for each in self._force)
        return known and since is not None and stamp - since >= LIGHT_TIME


class Outage(NamedTuple):
    """What to do about missing sensors in one tick.

    Attributes:
        reason: Why the robot must not walk; None if it may.
        kind: Tells reasons apart; the log shows each once.
        fallen: The robot lies: take the torque off.
        imu_returned: The IMU is back after an outage.
    """

    reason: str | None = None
    kind: str = ""
    fallen: bool = False
    imu_returned: bool = False


NO_OUTAGE = Outage()


class SensorOutage:
    """Decides once per tick whether the sensors are good enough to walk.

    Args:
        mass: Mass of the robot [kg].
        imu_patience: Time without an IMU [s] after which the robot stops walking.

    Attributes:
        loads: The loads on the soles.
        blind: Time without an IMU at the last tick [ns].
    """

    def __init__(self, mass: float, imu_patience: float) -> None:
        self.loads = SoleLoads(mass)
        self._patience = round(imu_patience * 1e9)
        self.blind = 0

    def assess(
        self, stamp: int, sync: FrameSync, unread_since: int | None, is_fallen: bool
    ) -> Outage:
        """Assess the sensors of one frame.

        Args:
            stamp: Stamp of the frame [ns].
            sync: Knows since when the IMU is missing.
            unread_since: Stamp since which joints cannot be read [ns]; None if they can.
            is_fallen: The gait knows that the robot lies.

        Returns:
            What to do.
        """
        before = self.blind
        self.blind = 0 if sync.blind_since is None else stamp - sync.blind_since + 1
        if self.blind > self._patience:
            if is_fallen or self.loads.are_light(stamp):
                text = f"imu/data: none for {self.blind * 1e-9:.1f} s, and the soles carry no load"
                return Outage(f"{text}: relaxing", "imu/data, fallen", fallen=True)
            return self._no_imu(sync.imu_behind)
        if self.blind == 0 and before > self._patience:
            self.loads.clear()
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
