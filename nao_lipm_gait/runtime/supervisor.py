"""What the gait gets in a tick: the commanded velocity, or what the state of the robot allows."""

from dataclasses import dataclass

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.motion.scheduler import GET_UP
from nao_lipm_gait.runtime.commands import BiasWait, HeldVelocity, MotionRequests
from nao_lipm_gait.runtime.diagnostics import COMMANDS, SENSORS, Diagnostics
from nao_lipm_gait.runtime.diagnostics import WALK as WALK_GROUP
from nao_lipm_gait.runtime.inputs import LoadInput, TemperatureInput, TwistInput, read_velocity
from nao_lipm_gait.runtime.intake import Gaps, NewTime
from nao_lipm_gait.runtime.sensor_check import SensorCheck
from nao_lipm_gait.runtime.stand_check import StandCheck
from nao_lipm_gait.runtime.watches import (
    LIFT_TIME,
    LOAD_AGE,
    HeatWatch,
    LiftWatch,
    SensorOutage,
    SoleLoads,
)
from robot_core.errors import NaoGaitError
from robot_core.log import Level
from robot_core.message_checks import finite, stamp_of
from robot_core.motion.keyframes import Motion
from robot_core.motion.loader import MotionLoader
from robot_core.types import (
    BUSY,
    DOWN,
    IN_MOTION,
    ON_THE_WAY,
    STAND,
    STANDSTILL,
    WALK,
    GaitStatus,
    SensorFrame,
    VelocityCommand,
)

LONGEST_NAME = 1000
"""[characters] of a motion's name or path."""
HELD_MAX = 5
"""Ticks in a row without usable targets, after which the gait restarts."""
LOAD_ABSURD = 1e5
"""[N]"""
TEMPERATURE_ABSURD = 500.0
"""[deg C]"""
CARRIED_TIME = 60_000_000
"""[ns] of load on both soles after which a robot that seems to lie does not."""
LOADS_AWAITED = 20
"""Frames without a wrong pose, or without load on both soles, that clear up a doubt."""
FIRST_STEPS = 3
"""Steps at the beginning of a walk that are so small that it can end within one. With 1 of them two
of three T1 whose ankle roll reads double still step 2 s after it is named."""
SIT_DOWN = "sit"
"""Motion that saves hot legs."""


@dataclass(frozen=True, slots=True)
class ControllerSettings:
    """What does not change while the controller runs.

    Attributes:
        control_period: Time between two joint states [s].
        cmd_vel_timeout: Age [s] at which a velocity command means stop.
        imu_patience: Time [s] without an IMU after which the robot stops walking.
        bias_wait: Longest time [s] to stand before the first walk until the gyro's bias is known; a
            walk with an unknown bias turns.
        hot_speed: Factor on the commanded velocity while a motor is hot; 1 = unchanged.
    """

    control_period: float = 0.01
    cmd_vel_timeout: float = 0.5
    imu_patience: float = 0.1
    bias_wait: float = 0.0
    hot_speed: float = 1.0


class Supervisor:
    """Decides what the gait gets, by the commands and by what is wrong with the robot.

    Args:
        gait: The gait, of which it requests a stand, a restart, a fall or a motion.
        settings: What does not change.
        say: Takes what is to be said.
    """

    def __init__(self, gait: Gait, settings: ControllerSettings, say: Diagnostics) -> None:
        self._gait = gait
        self._say = say
        self.velocity = HeldVelocity(settings.cmd_vel_timeout, say)
        self._bias_wait = BiasWait(settings.bias_wait)
        self._motions = MotionRequests()
        self._files = MotionLoader(gait.robot)
        self._results: list[str] = []
        self._loads = SoleLoads(gait.mass)
        self._lift = None if gait.robot.force_sensors is None else LiftWatch(self._loads)
        self._outage = SensorOutage(self._loads, settings.imu_patience)
        self._heat = HeatWatch(gait.robot, say, settings.hot_speed)
        self._check = SensorCheck(gait.robot, settings.control_period)
        self._stand_check = StandCheck(gait.robot)
        self._motors_ready = self._alone = True
        self._was_alone = False
        self._admitted = False
        self._doubt: NaoGaitError | None = None
        self._cleared = 0
        self._ticked = False
        self._held = 0

    @property
    def needs_loads(self) -> bool:
        """The messages of the soles: with force sensors, without an IMU, if the robot may lie."""
        check = self._check
        return bool(
            self._lift is not None or self._outage.blind or check.seems_to_lie or check.trouble
            or self._doubt is not None
        )  # fmt: skip

    @property
    def drives(self) -> bool:
        """The joints should follow the targets: the robot stands or walks by its own motors."""
        state = self._gait.state
        return self._motors_ready and self._alone and (state is STAND or state in ON_THE_WAY)

    # -- messages ----------------------------------------------------------------------------------

    def receive(self, message: TwistInput | LoadInput | TemperatureInput, now: int | None) -> None:
        """Take a message; `now` is the newest stamp of joint states [ns], None before the first.

        Raises:
            NaoGaitError: If it cannot be used.
        """
        if isinstance(message, TwistInput):
            # Its arrival counts, not its stamp: senders may use another clock than the sensors.
            self.velocity.receive(read_velocity(message), now)
        elif isinstance(message, LoadInput):
            stamp = stamp_of(message.sec, message.nanosec, "wrench header.stamp")
            force = finite(message.force, "wrench force.z", LOAD_ABSURD, "N")
            if abs(stamp - (now or 0)) < LOAD_AGE:  # else it is of another time
                self._loads.add(message.side, stamp, force)
        else:
            degrees = finite(message.degrees, "temperature", TEMPERATURE_ABSURD, "deg C")
            self._heat.receive(message.joint, degrees, (now or 0) * 1e-9)

    def note_motors(self, ready: bool) -> None:
        """Record whether the motors follow what is commanded; until then the robot stands."""
        self._motors_ready = ready
        if ready:
            self._say.end("motors", "the motors are ready")

    def note_gaits(self, count: int) -> bool:
        """Record how many gaits there are: of two, the robot follows the other one perhaps.

        Then its sensors are not judged by what this one does.

        Returns:
            There have been more since this one began, so that what it found wrong is forgotten.
        """
        self._alone = count <= 1
        self._was_alone = self._was_alone or self._alone
        if not self._was_alone and self._check.trouble:
            self._check.restart()
        return not self._was_alone

    # -- the tick ----------------------------------------------------------------------------------

    def admit(self, frame: SensorFrame, *, last: bool = False) -> None:
        """Check the pose in which the robot is found, before it gets its first targets.

        Args:
            frame: Sensors.
            last: No later frame comes before this one is answered.

        Raises:
            NaoGaitError: It stands on both soles and its joints say that it does not, or the loads
                of the soles, which tell whether it stands, are awaited.
        """
        if self._admitted:
            return
        wrong = self._check.wrong_pose(frame)
        self._doubt = wrong or self._doubt
        if self._doubt is not None:
            loads, stamp = self._loads, frame.stamp
            stands = loads.both_carry if last else loads.both_time(stamp) >= CARRIED_TIME
            self._cleared = 0 if wrong is not None and stands else self._cleared + 1
            if self._cleared < (1 if last else LOADS_AWAITED):
                self._say.begin(SENSORS, Level.ERROR, "wrong pose", str(self._doubt))
                raise self._doubt
        self._admitted, self._doubt = True, None
        self._say.end("wrong pose", "the joints show a pose in which the robot may be")

    def decide(self, frame: SensorFrame, gaps: Gaps) -> tuple[SensorFrame, VelocityCommand]:
        """The frame and the velocity that the gait gets in this tick."""
        stamp, gait = frame.stamp, self._gait
        leg = self._heat.update(stamp * 1e-9, down=gait.state in DOWN)
        if leg:
            self._sit_down(leg)
        stands = self._sensors_are_missing(stamp, gaps) or gaps.off_rate or gaps.wrong
        if gaps.limp:
            stands = True
            gait.set_down()
        if gaps.wrong and gait.state in ON_THE_WAY and gait.status.step_count <= FIRST_STEPS:
            self.restart()  # the foot goes down where it is: wrong joints have led it
        if gaps.gyro_jumps and gait.state in ON_THE_WAY:
            self._check.refuse_gyro()
        if not self._check.done:
            frame, wrong = self._proven(frame, blind=gaps.blind_since is not None)
            stands = stands or wrong
        if self._alone and not self._stand_check.done:
            self._judge_stand(frame, in_doubt=stands)
        command = self._heat.limited(self.velocity.at(stamp))
        command = self._allowed(stamp, STANDSTILL if stands else command)
        if self._lift is not None and self._lift.update(stamp, frame.linear_acceleration):
            frame = frame._replace(lifted=True)
        return frame, command

    def follow(self, status: GaitStatus | None) -> None:
        """Follow the gait through its tick; None if it gave no usable targets."""
        if status is None:
            self._held += 1
            if self._held >= HELD_MAX:
                # The gait's internal state may be corrupt; standing does not depend on it.
                self._held = 0
                self.restart()
            return
        self._held = 0
        self._ticked = True
        if self._motions.is_open:
            waits, ended = self._gait.motion_waits, self._gait.motion_ended
            self._close(self._motions.update(status.state, status.motion, waits, ended))

    def _allowed(self, stamp: int, command: VelocityCommand) -> VelocityCommand:
        """The command, or standstill until motors and gyro are ready."""
        if not self._motors_ready:
            if not command.is_zero:
                text = "standing until the motors are ready"
                self._say.begin(COMMANDS, Level.OK, "motors", text)
            command = STANDSTILL
        wait = self._bias_wait
        if wait.over:
            return command
        sigma = self._gait.heading_drift_sigma if self._ticked else None
        stands = wait.update(stamp, self._gait.state, sigma)
        if wait.known:
            self._say.end("gyro bias", "the gyro's bias is known")
        elif wait.over:
            text = f"the gyro's bias is not known after {wait.longest:g} s of standing: the walk "
            self._say.end("gyro bias", text + "may turn")
        elif stands and not command.is_zero:
            text = f"standing until the gyro's bias is known, for {wait.longest:g} s of sensor time"
            self._say.begin(COMMANDS, Level.OK, "gyro bias", text + " at most")
        return STANDSTILL if stands else command

    def _proven(self, frame: SensorFrame, *, blind: bool) -> tuple[SensorFrame, bool]:
        """The frame for the gait, and whether the sensors are wrong: then the robot stands.

        blind: there is no IMU sample, so that nothing can be judged.
        """
        check, loads, stamp = self._check, self._loads, frame.stamp
        if blind:
            wrong = bool(check.trouble)
            return check.at_rest(frame) if wrong else frame, wrong
        if self._gait.state in IN_MOTION:
            check.seems_to_lie = False
        lay = check.seems_to_lie
        known = loads.are_known(stamp)
        light = not self._alone or loads.light_time(stamp) >= LIFT_TIME  # else it may be judged
        carried = loads.both_time(stamp) >= CARRIED_TIME
        state = self._gait.state
        told = not self.velocity.at(stamp).is_zero  # else it steps to catch itself
        frame = check.update(
            frame,
            stands=state is STAND,
            carried=carried,
            light=light,
            in_doubt=known and not carried,
            support=self._gait.support if told and state is WALK else 0,
        )
        if not check.trouble:
            self._say.end("wrong sensors", "the sensors measure what they should")
            return frame, False
        if check.fallen:
            self._gait.report_fall()
        elif lay:
            self._gait.reset()  # it was taken for a robot that lies
        elif self._gait.state in ON_THE_WAY:
            self._gait.request_stand()
        self._say.begin(SENSORS, Level.ERROR, "wrong sensors", check.trouble)
        return frame, True

    def _judge_stand(self, frame: SensorFrame, *, in_doubt: bool) -> None:
        """Look once, in a quiet stand on both soles, whether the robot stands as its joints say."""
        check, loads, stamp = self._stand_check, self._loads, frame.stamp
        carried = loads.both_time(stamp) >= CARRIED_TIME or not loads.are_known(stamp)
        stands = self._gait.state is STAND and self._motors_ready and carried and not in_doubt
        check.update(self._gait.corrected(frame), stands=stands)
        if check.warning:
            self._say.begin(SENSORS, Level.WARN, "stand", check.warning)

    def _sensors_are_missing(self, stamp: int, gaps: Gaps) -> bool:
        """Whether the robot must not walk in this tick; handles a fall and the end of an outage."""
        outage = self._outage.assess(stamp, gaps, self._gait.state)
        if outage.fallen:
            self._gait.report_fall()
        # A fallen robot stays fallen until the IMU has shown for some time that it is upright.
        if outage.imu_returned and self._gait.state not in BUSY:
            self.restart()
        if outage.reason is None:
            self._say.end("outage", "the sensors are complete again")
            return False
        self._say.begin(SENSORS, Level.ERROR, "outage", outage.reason, outage.log_key)
        return True

    # -- new beginnings ----------------------------------------------------------------------------

    def new_time(self, time: NewTime) -> None:
        """Continue on another time base, from a stand; if only the clock has jumped, stop first."""
        self._heat.restart(time.stamp * 1e-9)
        if time.first:
            return
        self.velocity.clear()
        self._loads.clear()
        if self._lift is not None:
            self._lift.restart()
        if not time.steady:
            self._admitted, self._cleared = False, 0
            if self._check.trouble:
                self._check.restart()  # the sensors may be mended
            self.restart(moved=True)
            return
        self._gait.continue_at(time.stamp)
        if self._gait.state in ON_THE_WAY:
            self._gait.request_stand()

    def restart(self, *, moved: bool = False) -> None:
        """Restart the gait; its first targets may be anywhere, the guard leads there."""
        self._gait.restart(moved=moved)
        self._bias_wait.restart()

    # -- requests ----------------------------------------------------------------------------------

    def stand(self) -> None:
        """Stop and stand."""
        self._forget_file("replaced by a stand")
        self.velocity.clear()
        self._gait.request_stand()

    def relax(self) -> None:
        """Take the torque off all joints."""
        self._forget_file("replaced by relax")
        self.velocity.clear()
        self._gait.request_relax()

    def request_motion(self, name: str) -> None:
        """Run a motion as soon as it can begin.

        Args:
            name: Name of the motion, or the path of its YAML file. A file is loaded beside the
                ticks; its motion is requested by `request_loaded`.

        Raises:
            NaoGaitError: For a motion that is unknown or cannot begin here.
        """
        if len(name) > LONGEST_NAME or not name.isprintable():
            allowed = f"at most {LONGEST_NAME} printable characters"
            error = NaoGaitError("motion", name[:LONGEST_NAME], allowed)
            self._results.append(f"motion: refused, {error}")
            raise error
        self._forget_file(f"replaced by {name}")
        if name.endswith(".yaml"):
            self._files.request(name)
        else:
            self._request(name, name)

    def request_loaded(self) -> None:
        """Request the motion of a file that has been loaded; raises as `request_motion`."""
        loaded = self._files.take()
        if loaded is not None:
            name, motion = loaded
            self._request(name, motion)

    @property
    def loads_file(self) -> bool:
        """The motion of a file waits for `request_loaded`."""
        return self._files.busy

    def _request(self, name: str, motion: str | Motion | NaoGaitError) -> None:
        try:
            if isinstance(motion, NaoGaitError):
                raise motion
            self._gait.request_motion(motion)
        except NaoGaitError as error:
            self._results.append(f"{name}: refused, {error}")
            raise
        self._close(self._motions.request(motion if isinstance(motion, str) else motion.name))

    def _forget_file(self, outcome: str) -> None:
        name = self._files.cancel()
        if name is not None:
            self._close(f"{name}: {outcome}")

    def get_up(self) -> None:
        """Get up from the floor; raises NaoGaitError if the robot does not lie."""
        self._forget_file(f"replaced by {GET_UP}")
        self._gait.request_motion(GET_UP)
        self._close(self._motions.request(GET_UP))

    def take_results(self) -> tuple[str, ...]:
        """What became of motions since the last call, as `name: outcome`."""
        if not self._results:
            return ()
        results, self._results = tuple(self._results), []
        return results

    def _sit_down(self, reason: str) -> None:
        """Stop and sit down; a robot that has no such motion stays as it is."""
        try:
            self.request_motion(SIT_DOWN)
        except NaoGaitError as error:
            text = f"{reason}, but the robot cannot sit down: {error}"
        else:
            text = f"{reason}: sitting down; ~/stand stands up again"
        self._say.event(WALK_GROUP, Level.ERROR, "hot legs", text)

    def _close(self, result: str | None) -> None:
        if result is None:
            return
        self._results.append(result)
        level = Level.OK if result.endswith(": done") else Level.WARN
        self._say.log(level, f"motion {result}")
