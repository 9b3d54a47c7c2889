"""What stops or slows a walk: missing sensors, a robot that is lifted, hot motors."""

from math import hypot, inf
from typing import NamedTuple

from nao_lipm_gait.runtime.diagnostics import WALK, Diagnostics
from nao_lipm_gait.runtime.frame_sync import MAX_IMU_AGE
from nao_lipm_gait.runtime.intake import Gaps
from robot_core.log import Level
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, FloatArray, GaitState, VelocityCommand

LIGHT_SHARE = 0.3
"""Share of the robot's weight; with less on both soles they do not carry the robot."""
LOAD_AGE = 300_000_000
"""[ns] Older loads are not used."""
LIFT_TIME = 150_000_000
"""[ns] without load after which the robot counts as lifted: twice the time in which a body falls
from the height of a swing foot, sqrt(2 h / g) = 75 ms, so longer than any flight of a walk."""
GROUND_TIME = 200_000_000
"""[ns] of load on both soles after which a lifted robot is back on the ground."""
FREE_FALL = 0.5 * GRAVITY
"""[m/s^2] A smaller specific force is that of a robot in flight."""
JOINT_PATIENCE = 300_000_000
"""[ns] without readable joints, after which the robot stops walking."""
LIGHT_TIME = 100_000_000
"""[ns] for which the soles must be light; longer than the flight phase of a walking robot."""
NO_LOAD = (GaitState.LIFTED, GaitState.GETTING_UP)
"""In these states soles without load do not mean a fall."""
HOT, COOL = 70.0, 65.0
"""[deg C] of a motor: from the first on it is hot, until it is below the second. A NAO takes torque
from its motors from about 75 deg C on."""
SIT = 78.0
"""[deg C] of a leg motor at which the robot sits down, before the motor can no longer carry it."""
TEMPERATURE_AGE = 10.0
"""[s] after which a temperature is forgotten. Robots send them once per second."""


class SoleLoads:
    """Tells from the normal forces since when the soles carry the robot's mass [kg], or do not."""

    def __init__(self, mass: float) -> None:
        self._least = LIGHT_SHARE * mass * GRAVITY
        self.clear()

    def clear(self) -> None:
        """Forget all loads."""
        self._force: list[tuple[int, float] | None] = [None, None]
        self._light_since: int | None = None
        self._both_since: int | None = None
        self._carried = [False, False]

    def add(self, side: int, stamp: int, force: float) -> None:
        """Keep the normal force [N] on the left (0) or right (1) sole at `stamp` [ns]."""
        self._force[side] = stamp, force
        self._carried[side] = self._carried[side] or force > self._least
        left, right = self._force
        if left is None or right is None:
            return
        light = left[1] + right[1] < self._least
        both = 2.0 * min(left[1], right[1]) > self._least
        self._light_since = _first(self._light_since, stamp) if light else None
        self._both_since = _first(self._both_since, stamp) if both else None

    def light_time(self, stamp: int) -> int:
        """Time [ns] until `stamp` for which they have not carried the robot; 0 if unknown."""
        return self._time(self._light_since, stamp)

    def both_time(self, stamp: int) -> int:
        """Time [ns] until `stamp` for which both have carried their part; 0 if unknown."""
        return self._time(self._both_since, stamp)

    @property
    def both_carry(self) -> bool:
        """Both carried their part when they were last measured."""
        return self._both_since is not None

    def are_known(self, stamp: int) -> bool:
        """Whether the loads of both soles are recent at `stamp` [ns]."""
        return all(each is not None and stamp - each[0] < LOAD_AGE for each in self._force)

    @property
    def sensors_work(self) -> bool:
        """Each sole has carried the robot before: its sensors are connected."""
        return all(self._carried)

    def _time(self, since: int | None, stamp: int) -> int:
        return 0 if since is None or not self.are_known(stamp) else stamp - since


def _first(since: int | None, stamp: int) -> int:
    return stamp if since is None else since


class LiftWatch:
    """Detects that the robot is lifted.

    The specific force times the mass is the sum of all contact forces. A robot whose soles carry
    next to nothing and that is not in free fall is carried by something else.
    """

    def __init__(self, loads: SoleLoads) -> None:
        self._loads = loads
        self.restart()

    def restart(self) -> None:
        """Begin again with other stamps, as the loads have to."""
        self._lifted = False
        self._flight: int | None = None

    def update(self, stamp: int, specific_force: FloatArray) -> bool:
        """Whether the robot is lifted at `stamp` [ns]; the torso's specific force (3,) [m/s^2]."""
        loads = self._loads
        if self._lifted:
            self._lifted = loads.are_known(stamp) and loads.both_time(stamp) < GROUND_TIME
            return self._lifted
        light = loads.light_time(stamp)
        if light > 0:
            if hypot(*specific_force.tolist()) < FREE_FALL:
                self._flight = stamp
            carried = light if self._flight is None else min(light, stamp - self._flight)
            self._lifted = carried > LIFT_TIME and loads.sensors_work
        return self._lifted


class Outage(NamedTuple):
    """What to do about missing sensors in one tick.

    Attributes:
        reason: Why the robot must not walk; None if it may.
        log_key: Tells reasons apart; the log shows each once.
        fallen: The robot lies.
        imu_returned: The IMU was missing until this tick, for so long that the robot had to stop.
    """

    reason: str | None = None
    log_key: str = ""
    fallen: bool = False
    imu_returned: bool = False


NO_OUTAGE = Outage()


class SensorOutage:
    """Decides once per tick whether the sensors are good enough to walk.

    Args:
        loads: They reveal a fall without an IMU.
        imu_patience: Time without an IMU [s] after which the robot stops walking.

    Attributes:
        blind: Time without an IMU at the last tick [ns].
    """

    def __init__(self, loads: SoleLoads, imu_patience: float) -> None:
        self._loads = loads
        self._patience = round(imu_patience * 1e9)
        self.blind = 0

    def assess(self, stamp: int, gaps: Gaps, state: GaitState) -> Outage:
        """Assess what is missing in the frame of this stamp [ns]."""
        before = self.blind
        self.blind = 0 if gaps.blind_since is None else stamp - gaps.blind_since + 1
        if self.blind > self._patience:
            lies = state is GaitState.FALLEN
            if lies or (state not in NO_LOAD and self._loads.light_time(stamp) >= LIGHT_TIME):
                why = "the robot lies" if lies else "the soles carry no load: relaxing"
                text = f"imu/data: none for {self.blind * 1e-9:.1f} s, and {why}"
                return Outage(text, "imu/data, fallen", fallen=True)
            return self._no_imu(gaps.imu_behind)
        outage = self._joints(stamp, gaps.unread_since)
        if self.blind == 0 and before > self._patience:
            self._loads.clear()
            return outage._replace(imu_returned=True)
        return outage

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


class HeatWatch:
    """Temperatures of the motors: it warns, and slows the walk down if `slower` says so.

    Args:
        robot: Its leg motors matter most.
        say: Where hot motors are reported.
        slower: Factor on the commanded velocity while a motor is hot; 1 = unchanged.
    """

    def __init__(self, robot: RobotDescription, say: Diagnostics, slower: float) -> None:
        self._legs = set(robot.leg_joints)
        self._joints = set(robot.joint_names)
        self._say = say
        self._slower = slower
        self._found: dict[str, tuple[float, float]] = {}
        self._oldest = inf
        self._leg_is_hot = self.hot = False
        self._leg_to_rest = ""

    def receive(self, joint: str, degrees: float, now: float) -> None:
        """Keep the temperature [deg C] of a motor at `now` [s] of the sensors' time."""
        if joint not in self._joints:
            return
        self._found[joint] = degrees, now
        self._say.end("temperatures", "temperatures of the motors arrive again")
        self._judge(now)

    def update(self, now: float, *, down: bool) -> str:
        """One tick at `now` [s] of the sensors' time.

        Returns:
            The leg because of which the robot has to sit down; empty without one. Once, as soon as
            the robot is not `down`, until the leg has cooled down.
        """
        if now - self._oldest >= TEMPERATURE_AGE:
            self._judge(now)
        if down or not self._leg_to_rest:
            return ""
        leg, self._leg_to_rest = self._leg_to_rest, ""
        return leg

    def restart(self, now: float) -> None:
        """Another clock begins at `now` [s]: what is known counts as received then."""
        self._found = {joint: (degrees, now) for joint, (degrees, _) in self._found.items()}
        self._oldest = now if self._found else inf

    def _judge(self, now: float) -> None:
        """Decide by the temperatures that are not old."""
        self._found = {
            each: kept for each, kept in self._found.items() if now - kept[1] < TEMPERATURE_AGE
        }
        self._oldest = min((at for _, at in self._found.values()), default=inf)
        if not self._found:
            self.hot = self._leg_is_hot = False
            self._leg_to_rest = ""
            text = (
                f"no temperature of a motor for {TEMPERATURE_AGE:g} s: it is not known whether one "
                "is hot"
            )
            self._say.begin(WALK, Level.WARN, "temperatures", text)
            self._say.end("heat", "the last temperature, of a hot motor, is too old")
            return
        hottest = max(self._found, key=lambda each: self._found[each][0])
        most = self._found[hottest][0]
        self.hot = most >= (COOL if self.hot else HOT)
        if self.hot:
            text = f"{hottest} is hot: {most:.0f} deg C"
            if self._slower < 1.0:
                text += f"; walking at {100.0 * self._slower:.0f} % of the commanded velocity"
            self._say.begin(WALK, Level.WARN, "heat", text)
        else:
            self._say.end("heat", "the motors have cooled down")
        self._judge_legs()

    def _judge_legs(self) -> None:
        degrees, leg = max(
            ((degrees, each) for each, (degrees, _) in self._found.items() if each in self._legs),
            default=(0.0, ""),
        )
        before, self._leg_is_hot = self._leg_is_hot, degrees >= (COOL if self._leg_is_hot else SIT)
        rests = self._leg_is_hot and (self._leg_to_rest or not before)
        self._leg_to_rest = f"{leg} at {degrees:.0f} deg C" if rests else ""

    def limited(self, command: VelocityCommand) -> VelocityCommand:
        """The command, slower while a motor is hot."""
        if not self.hot or self._slower >= 1.0:
            return command
        x, y, yaw = command
        return VelocityCommand(self._slower * x, self._slower * y, self._slower * yaw)
