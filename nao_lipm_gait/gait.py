"""The gait: one sensor frame in, joint targets out.

`Gait.step` is the whole tick, one stage after the other. It is deterministic: it uses no clock, no
I/O and no globals, so the same frames give the same targets. Equation numbers are those of Graf and
Röfer.
"""

from collections import deque
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration, SensorCorrection
from nao_lipm_gait.estimation.ground_tilt import GroundTilt
from nao_lipm_gait.estimation.hip_lag import HipLag
from nao_lipm_gait.estimation.sole_levelling import SoleLevelling, sole_springs
from nao_lipm_gait.estimation.stand_alignment import StandAlignment
from nao_lipm_gait.estimation.state_estimator import StateEstimator
from nao_lipm_gait.estimation.yaw_slip_from_lean import HEADING_LEAN
from nao_lipm_gait.frame_check import PERIOD, STAMP, check_inputs
from nao_lipm_gait.head.head_control import HeadControl
from nao_lipm_gait.modes import ModeInputs, Modes, Requests, Transition
from nao_lipm_gait.motion.scheduler import ATTEMPTS, MotionScheduler
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.presets import DEFAULT, preset_for
from nao_lipm_gait.similarity import Size, image_of
from nao_lipm_gait.status import make_status
from nao_lipm_gait.velocity_control import HeadingHold, SpeedHold, StepMean, outside_deadband
from nao_lipm_gait.walks.base import BodyTargets, MakeObserver, make_walk
from nao_lipm_gait.whole_body.body_model import BodyModel
from nao_lipm_gait.whole_body.com_placement import ComPlacement
from nao_lipm_gait.whole_body.feed_forward import FeedForward
from nao_lipm_gait.whole_body.ground_adaptation import GroundAdaptation
from nao_lipm_gait.whole_body.legs import make_legs
from nao_lipm_gait.whole_body.posture_feedback import PostureFeedback
from nao_lipm_gait.whole_body.stand_blend import SET_DOWN_TIME, STAND_TIME, StandBlend
from nao_lipm_gait.whole_body.step_kick import BALL, StepKick
from nao_lipm_gait.whole_body.tilt_compensation import TiltCompensation
from robot_core import head_goals
from robot_core.errors import NaoGaitError
from robot_core.geometry import ORIGIN, compose
from robot_core.head_goals import Goal
from robot_core.joint_limits import JointLimits
from robot_core.message_checks import read_array
from robot_core.motion.joints import BODY, joint_groups
from robot_core.motion.keyframes import Motion
from robot_core.motion.library import MotionLibrary
from robot_core.rate_limiter import RateLimiter, limited_step
from robot_core.robot import RobotDescription, load_robot
from robot_core.schema import Number, Switch
from robot_core.types import (
    DOWN,
    IN_MOTION,
    LIFTED,
    MOTION,
    ON_THE_WAY,
    STAND,
    STANDSTILL,
    UPRIGHT,
    WALK,
    FloatArray,
    GaitState,
    GaitStatus,
    Given,
    JointTargets,
    Point2,
    Pose6,
    SensorFrame,
    VelocityCommand,
)

MISSED_TICKS_MAX = 20
"""Longest gap between two frames that the gait bridges; after a longer one it restarts."""
FLOOR_MASS = 6.0
"""[kg] Robots that are heavier walk on floors that are stiffer in proportion."""
HEIGHT_RATE = 0.05
"""Rate [m/s] at which the CoM height follows its parameter."""
INWARD_MAX = 0.3
"""Share of the foot spacing by which a sole may be off where the walk begins."""
PITCH_RATE = 0.1
"""Rate [rad/s] at which the torso's pitch follows its parameters."""
CAUTIOUS_SHARE, CAUTIOUS_TURN_SHARE = 0.55, 0.3
"""Shares of the largest step sizes and turns that are used until the tilt of the soles is known."""


class Gait:
    """Makes one robot walk.

    Args:
        robot: Robot to walk with, or its shipped name or file (URDF, MJCF, robot file).
        parameters: Parameters of the gait, or the name or file of a preset.
        control_period: Time [s] between two sensor frames, 0.002 to 0.05.
        motions: Motions of this robot; None = the shipped ones, read when one is first requested.
        calibration: Known constant errors of its sensors.
        make_observer: Makes a CoM observer of your own from the parameters, for `walk: lipm`.
        **changes: Parameters to change, by name: `swing_lift=0.03`.

    Raises:
        NaoGaitError: There is no such robot, preset or parameter, or its value is not allowed.

    Attributes:
        robot: Robot to walk with.
        levelling: Relative tilt of the soles, learned while the robot walks. It outlives a reset.
    """

    def __init__(
        self,
        robot: RobotDescription | str | Path,
        parameters: GaitParameters | str | Path = DEFAULT,
        control_period: Given[float] = 0.01,
        motions: MotionLibrary | None = None,
        calibration: Calibration = NOT_CALIBRATED,
        make_observer: MakeObserver | None = None,
        **changes: bool | float | str,
    ) -> None:
        if not isinstance(robot, RobotDescription):
            robot = load_robot(robot)
        if not isinstance(parameters, GaitParameters):
            parameters = preset_for(robot, parameters)
        if changes:
            parameters = parameters.replace(**changes)
        period = PERIOD.check("control_period", control_period)
        if not (motions is None or isinstance(motions, MotionLibrary)):
            raise NaoGaitError("motions", motions, "a MotionLibrary or None")
        if not isinstance(calibration, Calibration):
            raise NaoGaitError("calibration", calibration, "a Calibration")
        if not (make_observer is None or callable(make_observer)):
            raise NaoGaitError("make_observer", make_observer, "a function of the parameters")
        self.robot = robot
        self._size = Size(robot.size)
        self._image = image_of(robot)
        self._make_observer = make_observer
        self._library = motions
        self._calibration = calibration
        self._correction = SensorCorrection(robot, calibration)
        self._parameters = parameters
        self._pending: GaitParameters | None = None
        self._dt = self._elapsed = period / self._size.time
        self._period = round(period * 1e9)
        self._joints = len(robot.joint_names)
        self._body = BodyModel(self._image)
        self._limits = JointLimits(self._image)
        self._head = HeadControl(self._image)
        self._requests = Requests()
        self._lift_share = 1.0
        # The torso rolls with motors that give way, by more than the soles are askew.
        self.levelling = SoleLevelling(
            sole_springs(self._image.sole_corners, self._image_mass()),
            calibration.sole_pitch,
            calibration.sole_roll,
            calibration.lean,
            known=calibration != NOT_CALIBRATED,
            learns_roll=not robot.soft_joint,
        )
        self._alignment = StandAlignment()
        self._hip_lag = HipLag(self._image)
        ahead = [corner[0] for corner in self._image.sole_outline]
        self._ground = GroundTilt(min(ahead), max(ahead))
        self._begin()

    def reset(self) -> None:
        """Forget all but requests and sensor errors; the next frame begins a stand."""
        before = self._estimator
        self._begin()
        self._estimator.keep_gyro_bias(before)

    def _begin(self) -> None:
        p = self._parameters = self._pending or self._parameters
        self._pending = None
        self._cautious = False
        self._walk = make_walk(self._walk_parameters(p), self._dt, self._make_observer)
        self._walk.hip_lag = self._hip_lag.mean
        self._delay_ticks = self._walk.delay_ticks
        self._late = 0
        self._estimator = StateEstimator(
            self._body, self._size.parameters(p), self._dt, self.levelling, self._alignment,
            self._ground, yaw_gyro=self.robot.has_yaw_gyro,
        )  # fmt: skip
        motions = MotionScheduler(self.robot, self._library)
        self._modes = Modes(self._requests, motions, self._estimator, self._walk)
        self._heading_hold = HeadingHold()
        self._speed_hold = SpeedHold()
        self._step_mean = StepMean()
        self._height = RateLimiter(HEIGHT_RATE)
        self._pitch = RateLimiter(PITCH_RATE)
        self._heading_lean = RateLimiter(PITCH_RATE, 0.0)
        self._step_kick = StepKick(self._image.sole_outline)
        self._tilt_compensation = TiltCompensation()
        self._ground_adaptation = GroundAdaptation()
        self._placement = ComPlacement(self._image, self._body, make_legs(self._image))
        self._blend = StandBlend()
        self._posture = PostureFeedback(self.robot)
        self._feed_forward = FeedForward(self.robot)
        self._head.rest()
        self._last_command = STANDSTILL
        self._last_position: FloatArray | None = None
        self._sent: FloatArray = self.robot.stand_pose
        self._targets: BodyTargets | None = None
        self._stamp: int | None = None
        self._ahead = 0
        self._sent_before: deque[FloatArray] = deque(maxlen=self._delay_ticks + 2)
        self._residual = 0.0
        self._clipped = 0

    def _image_mass(self) -> float:
        """Mass [kg] under which the ground yields to the image's soles as to the robot's."""
        if self._size.same:
            return self._body.total_mass
        return min(self._body.total_mass, FLOOR_MASS) / self._size.length

    # -- the tick ----------------------------------------------------------------------------------

    def step(self, frame: Given[SensorFrame], command: Given[VelocityCommand]) -> JointTargets:
        """One control tick: SensorFrame -> JointTargets.

        Args:
            frame: Sensors of one instant. A stamp that goes back, or a gap of more than
                `MISSED_TICKS_MAX` periods, resets the gait.
            command: Commanded velocity; each axis has a `DEADBAND`.

        Returns:
            Joint targets inside the joint limits.

        Raises:
            NaoGaitError: A number is not finite, or an array has another shape; nothing changes.
        """
        return self._step(frame, check_inputs(frame, command, self._joints))

    def _step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        command = outside_deadband(command)
        # Constant errors of the sensors.
        frame = self._size.frame(self._correction.sensed(frame))
        command = self._size.command(command)

        # Control periods without a frame, and plans that are due.
        missed, plans = self._catch_up(frame)
        dt = (missed + 1) * self._dt

        # Expectation: support leg, sole and CoM at the time of the measurement.
        expected = self._walk.expect()

        # State estimation: torso orientation, measured CoM (11), odometry.
        settled = self._modes.state is STAND and not self._blend.active
        self._estimator.update(frame, expected, self._modes.state, dt, settled=settled)
        soles = self.levelling
        self._correction.set_soles(soles.applied_pitch, soles.applied_roll, soles.applied_lean)
        if self._cautious and self.levelling.known:
            self._cautious = False  # only once
            self.set_parameters(self.parameters)

        # Modes.
        gets_up = self._parameters.get_up
        transition = self._modes.update(ModeInputs(command, settled, gets_up, dt, frame.lifted))
        if transition is not None:
            self._carry_out(transition, frame, command)
        state = self._modes.state
        if state is not STAND:
            self._estimator.reset_tipping()
        if self._modes.fell or state is LIFTED:
            self._heading_hold.release()
        if state in DOWN:
            return self._limp_targets(frame)
        if state in IN_MOTION:
            return self._motion_targets(frame)

        # Weak motors. Without a delay the target after the one that is answered is not known yet.
        sent = self._sent_before
        if missed:
            sent.clear()  # it no longer tells which targets the joints answer
        answers = self._delay_ticks > 0 and len(sent) == sent.maxlen and self._late == 0
        if self._walk.watches_hips and answers and state is WALK:
            step = expected.wanted_step[0]
            answered = sent[0], sent[1], sent[2]
            self._hip_lag.update(expected.support, step, frame.joint_position, answered, dt)
            self._walk.hip_lag = self._hip_lag.mean
        else:
            self._hip_lag.interrupt()

        # Observation: CoM observer (10)-(14).
        x, y, _ = self._estimator.com_in_q
        self._walk.observe(x, y, self._estimator.acceleration_in_q)

        walking = state in ON_THE_WAY and not self._modes.must_stop
        wanted = self._corrected(command, dt) if walking else STANDSTILL
        self._last_command = self._step_mean.update(wanted, self._walk.predicted.step_count)
        return self._next_targets(frame.stamp, walking, measured=True, moves_on=plans > 0)

    def coast(self) -> JointTargets | None:
        """Joint targets for a control period whose frame has not arrived in time.

        The walk plans one period more, without a measurement. The next frame then has that period
        to expect, but no longer to plan, whether it is the next one or the one that was late.

        Returns:
            Joint targets inside the joint limits, with the stamp of the frame that is missing; None
            if the robot does not walk and can wait for it.
        """
        if self._stamp is None or self._modes.state not in ON_THE_WAY:
            return None
        self._ahead += 1
        self._elapsed = self._dt
        walking = not self._modes.must_stop
        stamp = self._stamp + self._ahead * self._period
        return self._next_targets(stamp, walking, measured=False, moves_on=True)

    def _next_targets(
        self, stamp: int, walking: bool, *, measured: bool, moves_on: bool
    ) -> JointTargets:
        """The second half of the tick: from the plan to joint targets.

        Args:
            stamp: Stamp [ns] of the frame that is answered.
            walking: The robot follows its command.
            measured: There is a new frame.
            moves_on: The walk plans one control period more; else the last one again.
        """
        state, dt = self._modes.state, self._elapsed

        # Plan: prediction by the delay (21), pendulum (15)-(20), support change, steps (3)-(9).
        support_before = self._walk.predicted.support
        planned = self._walk.plan(self._last_command) if moves_on else self._walk.replan()

        # Targets of CoM, soles and torso.
        targets = self._limited(planned, walking)
        support = self._walk.predicted.support
        if support != support_before or state not in ON_THE_WAY:
            self._apply_pending()
        p = self._parameters

        # A kick of the swing foot.
        if state is WALK:
            if support != support_before:
                base = self._estimator.odometry.base_footprint_in_odom
                reach, lift = p.kick_reach, p.swing_lift
                self._walk.lengthen(
                    self._step_kick.begin_step(-support, base, p.foot_spacing, reach, lift)
                )
            targets = self._step_kick.apply(
                targets, support, self._walk.time_left, dt if moves_on else 0.0
            )

        # Compensation of the torso's tilt by the feet.
        if p.feedback and state in ON_THE_WAY:
            unwanted = (0.0, 0.0)
            if state is WALK:
                unwanted = self._estimator.tilt_error(targets.torso_pitch)
            targets = self._tilt_compensation.apply(targets, support, unwanted, p, dt)
        # Ground that slopes.
        targets = self._ground_adaptation.apply(
            targets, support, self._ground, dt, walks=state is WALK
        )
        self._targets = targets

        # Placement: inverse kinematics that put the whole body's CoM at its target.
        placed = self._placement.place(targets, p.arm_swing)
        self._residual = placed.residual

        # Blending from the pose in which a stand began.
        position = self._blend.apply(placed.position, dt)

        # Posture feedback by the gyro, eq (7) of Friedmann et al.
        if p.feedback and state is WALK:
            rate = self._estimator.angular_velocity if measured else None
            self._posture.apply(position, support, rate, p)

        # Head, joint limits.
        self._turn_head(position)
        sent = self._for_motors(position)

        # Torques of motors that give way.
        if not self._feed_forward.needed:
            return JointTargets(stamp, sent)
        standing = state not in ON_THE_WAY or self._walk.stopping
        lead = self._feed_forward.lead(
            sent, targets, 0 if standing else support, self._walk.origin_in_q, dt * self._size.time,
            0.0 if standing else self._walk.com_ahead,
        )  # fmt: skip
        if state is LIFTED:
            return JointTargets(stamp, sent)
        leading: FloatArray = sent + lead
        self._limits.cut(leading)
        return JointTargets(stamp, leading, lead=leading - sent)

    # -- parts of the tick -------------------------------------------------------------------------

    def _catch_up(self, frame: SensorFrame) -> tuple[int, int]:
        """Let the pendulum move on through the control periods since the last frame.

        The robot moved on while frames were lost or late. Each period is expected once, by the
        stamps, and planned once, by the arrival of the frames: periods that `coast` has planned
        and frames that come early get no plan of their own. Of two lost frames, for example, both
        are expected and planned here, and the one that has arrived by `step`.

        Args:
            frame: The frame that has arrived.

        Returns:
            The lost frames, and the plans that are due in this tick, of which the last is still to
            be made.
        """
        missed = self._missed_ticks(frame)
        due, ahead = self._due_plans(frame.late, missed + 1), self._ahead
        plans, self._ahead = max(0, due - ahead), max(0, ahead - due)
        for tick in range(max(missed, plans - 1)):
            if tick < missed:
                self._walk.expect()
            if tick < plans - 1:
                self._walk.plan(self._last_command, sent=tick < missed)
        self._elapsed = max(1, missed + 1 - ahead) * self._dt
        return missed, plans

    def _missed_ticks(self, frame: SensorFrame) -> int:
        """Number of frames lost since the last one; starts again with the first frame or a jump."""
        last, self._stamp = self._stamp, frame.stamp
        ticks = 0 if last is None else round((frame.stamp - last) / self._period)
        if 1 <= ticks <= MISSED_TICKS_MAX:
            return ticks - 1
        if last is not None:
            self.reset()
            self._stamp = frame.stamp
        self._begin_stand(frame.late, frame.joint_position)
        self._sent = self._correction.for_motors(self._measured_position(frame))
        lies, upright = self._estimator.begin(frame)
        self._modes.begin(lies=lies, upright=upright)
        if self._modes.state is MOTION:
            self._estimator.reset_lying_side()
        return 0

    def _due_plans(self, late: int, ticks: int) -> int:
        """Number of control periods to plan in this tick: those that have passed since the last.

        Expectations follow the stamps of the frames, plans their arrival. The two differ when the
        age of the frames changes: by that many control periods.

        Args:
            late: Control periods by which the frame is older than `feedback_delay` assumes.
            ticks: Control periods since the last frame, by the stamps.
        """
        plans = ticks
        if late != self._late and self._modes.state in UPRIGHT:
            plans = max(0, ticks + self._bridged(late) - self._late)
            self._set_late(self._late + plans - ticks)
        return plans

    def _bridged(self, late: int) -> int:
        """`late` as far as a walk can bridge it: a command shows after one control period."""
        return max(late, min(0, 1 - self._delay_ticks))

    def _set_late(self, late: int) -> None:
        self._late = late
        self._walk.delay_ticks = self._delay_ticks + late

    def _carry_out(
        self, transition: Transition, frame: SensorFrame, command: VelocityCommand
    ) -> None:
        before, after, motion = transition.before, transition.after, transition.motion
        if after in IN_MOTION and motion is not None:
            self._begin_motion(motion, frame)
        elif after is WALK and before is STAND:
            self._begin_walk(transition, command)
        elif after is STAND and before is WALK and not self._walk.finished:
            self._begin_stand(frame.late, self._sent_by_model(frame), time=SET_DOWN_TIME)
        elif after is LIFTED or (after is STAND and before not in ON_THE_WAY):
            start = self._sent_by_model(frame)
            # A motion that kept its feet ends in the stand; after a get-up the robot must settle.
            in_place = motion is not None and not motion.gets_up
            self._begin_stand(frame.late, start, joint_groups(self.robot)[BODY] if in_place else ())
            self._feed_forward.begin()

    def _sent_by_model(self, frame: SensorFrame) -> FloatArray:
        """The last targets (n,) [rad] as the model has them; before the first the measured pose."""
        return frame.joint_position if self._last_position is None else self._last_position

    def _begin_stand(
        self, late: int, start: FloatArray, watched: Sequence[int] = (), time: float = STAND_TIME
    ) -> None:
        """Begin to stand up from joint angles (n,) [rad].

        Args:
            late: See `SensorFrame`.
            start: Joint angles (n,) [rad].
            watched: See `StandBlend.begin`.
            time: Duration [s].
        """
        self._set_late(self._bridged(late))
        self._walk.stand_at(ORIGIN)
        self._height.reset()
        self._pitch.reset()
        self._blend.begin(start, watched, time)

    def _begin_walk(self, transition: Transition, command: VelocityCommand) -> None:
        if transition.tipping_com is None:
            # The ground holds the feet where they were before the stand, if the motors give way.
            p, inward = self._parameters, 0.0
            if p.feedback and self.robot.soft_joint:
                inward = 0.5 * (p.foot_spacing - self._estimator.feet_apart)
            self._walk.start(command, limited_step(0.0, inward, INWARD_MAX * p.foot_spacing))
        else:
            self._walk.catch(*transition.tipping_com)
        self._tilt_compensation = TiltCompensation()
        self._speed_hold.begin()

    def _begin_motion(self, motion: Motion, frame: SensorFrame) -> None:
        self._walk.stand_at(ORIGIN)
        for _ in range(2):  # the placement extrapolates the CoM; the second time it is at rest
            placed = self._placement.place(self._walk.plan(STANDSTILL))
        self._limits.cut(placed.position)
        start = self._last_position
        self._modes.motions.begin(
            motion, self._measured_position(frame) if start is None else start, placed.position
        )
        self._estimator.reset_lying_side()

    def _corrected(self, command: VelocityCommand, dt: float) -> VelocityCommand:
        """The command with the corrections that hold speed and heading."""
        p, odometry = self._parameters, self._estimator.odometry
        if p.feedback and p.speed_time > 0.0:
            command = self._speed_hold.correct(
                command, odometry.velocity, self._walk.reserve, p.speed_time, dt
            )
        # Also called without feedback, which releases the heading held until then.
        gain = p.heading_gain if p.feedback else 0.0
        heading = odometry.base_footprint_in_odom[2]
        return self._heading_hold.correct(command, heading, gain, dt)

    def _limited(self, planned: BodyTargets, walking: bool) -> BodyTargets:
        """The planned targets with CoM height and torso pitch limited in rate.

        Without a yaw gyro a turn shows in the roll gyro only as far as the torso leans (see
        `estimation/yaw_slip.py`). It therefore leans further forward while a heading is held.
        """
        p, dt = self._parameters, self._elapsed
        x, y, height = planned.com_in_q
        height = self._height.update(height, dt)
        pitch = self._pitch.update(planned.torso_pitch, dt)
        leans = p.yaw_from_lean and not self.robot.has_yaw_gyro
        leans = leans and self._heading_hold.holds and walking
        lean = self._heading_lean.update(HEADING_LEAN if leans else 0.0, dt)
        return planned.posed((x, y, height), pitch + lean)

    def _turn_head(self, position: FloatArray) -> None:
        if not self._head.is_free:
            self._head.apply(position, self._estimator.torso_place, self._elapsed)

    def _for_motors(self, position: FloatArray) -> FloatArray:
        """Joint targets (n,) [rad] of the motors: with their offsets, inside the joint limits."""
        targets = self._correction.for_motors(position)
        self._clipped = self._limits.cut(targets)
        self._limits.slow_down(targets, self._sent, self._elapsed)
        self._sent = targets
        self._last_position = self._correction.for_model(targets)
        self._sent_before.append(self._last_position)
        return targets

    def _motion_targets(self, frame: SensorFrame) -> JointTargets:
        """Targets of the running motion."""
        motions = self._modes.motions
        rates = self._size.rates(self._estimator.angular_velocity)
        targets = motions.advance(self._elapsed * self._size.time, rates)
        if motions.turns_head:
            self._head.yield_to(targets.position)
        else:
            self._turn_head(targets.position)
        self._residual = 0.0
        position = self._for_motors(targets.position)
        lowest = float(np.min(targets.stiffness))
        uniform = lowest == float(np.max(targets.stiffness))
        return JointTargets(frame.stamp, position, lowest, None if uniform else targets.stiffness)

    def _limp_targets(self, frame: SensorFrame) -> JointTargets:
        """The measured pose without torque."""
        self._head.rest()
        self._residual = 0.0
        self._clipped = 0
        self._last_position = None
        self._sent = self._correction.for_motors(self._measured_position(frame))
        self._limits.cut(self._sent)
        return JointTargets(frame.stamp, self._sent, stiffness=0.0)

    def _measured_position(self, frame: SensorFrame) -> FloatArray:
        """Measured joint angles (n,) [rad], clipped at the joint limits."""
        position = np.array(frame.joint_position, dtype=float)
        self._limits.cut(position)
        return position

    # -- restarts and parameters -------------------------------------------------------------------

    def restart(self, *, moved: Given[bool] = False) -> None:
        """Reset after a gap in the frames, but keep the robot limp, fallen or sitting if it is so.

        A robot that was getting up tries again. `moved`: someone may have put it on its feet
        meanwhile; a fallen one stands at once if the next frame shows it upright.
        """
        moved = Switch().check("moved", moved)
        before, position = self._modes, self._last_position
        self.reset()
        self._modes.continue_from(before, moved=moved)
        if self._modes.resumes:
            self._last_position = position

    def continue_at(self, stamp: Given[int]) -> None:
        """Go on without a reset although the clock was set; stamp [ns]: of the next frame."""
        stamp = int(STAMP.check("stamp", stamp))
        if self._stamp is not None:
            self._stamp = stamp - self._period

    def set_parameters(self, parameters: GaitParameters) -> None:
        """Change the parameters; a walk applies them at its next support change.

        `NEEDS_RESET` ones take effect at the next reset; so do all with another walk engine.

        Raises:
            NaoGaitError: They are no `GaitParameters`.
        """
        if not isinstance(parameters, GaitParameters):
            raise NaoGaitError("parameters", parameters, "GaitParameters")
        self._pending = parameters
        if self._modes.state not in ON_THE_WAY:
            self._apply_pending()

    def _apply_pending(self) -> None:
        parameters = self._pending
        if parameters is None or parameters.walk != self._parameters.walk:
            return
        self._pending = None
        self._parameters = parameters
        self._walk.set_parameters(self._walk_parameters(parameters))
        self._estimator.set_parameters(self._size.parameters(parameters))

    def _walk_parameters(self, parameters: GaitParameters) -> GaitParameters:
        """The parameters of the walk, with shorter steps until the soles are level."""
        p = self._size.parameters(parameters)
        if self._lift_share < 1.0:
            p = p.replace(swing_lift=self._lift_share * p.swing_lift)
        self._cautious = p.level_soles and p.feedback and not self.levelling.known
        if not self._cautious:
            return p
        return p.replace(
            step_forward_max=CAUTIOUS_SHARE * p.step_forward_max,
            step_backward_max=CAUTIOUS_SHARE * p.step_backward_max,
            step_side_max=CAUTIOUS_SHARE * p.step_side_max,
            step_turn_max=CAUTIOUS_TURN_SHARE * p.step_turn_max,
        )

    # -- requests ----------------------------------------------------------------------------------

    def request_stand(self) -> None:
        """Stop walking, or leave a sitting or relaxed pose, and stand."""
        self._requests.stand = True

    def request_relax(self) -> None:
        """Take the torque off all joints in the next tick."""
        self._requests.relax = True

    def set_down(self) -> None:
        """In this tick, put both feet down at once instead of walking, and take no step.

        For a leg that cannot carry the robot; a stop needs a few more steps.
        """
        self._requests.set_down = True

    def report_fall(self) -> None:
        """Another sensor has detected a fall: the robot counts as fallen in the next tick."""
        self._requests.fall = True

    def request_motion(self, motion: str | Motion) -> None:
        """Run a motion at once, or when the walk or another motion has ended.

        Args:
            motion: Name of a motion, `get_up`, or a motion that is in no library.

        Raises:
            NaoGaitError: The motion is unknown or cannot begin from the robot's posture.
        """
        self._modes.motions.request(motion, self._modes.next_posture)

    def request_look(self, goal: Goal | None) -> None:
        """Turn the head towards a goal, in any mode; None ends it.

        Raises:
            NaoGaitError: The robot has no head joints, or the goal is not finite.
        """
        goal = head_goals.checked(goal)
        if not self._head.exists:
            raise NaoGaitError("head", "none", "a robot with a `head` in its file")
        self._head.ask(self._size.goal(goal))

    def request_lift(self, share: Given[float]) -> None:
        """Lift the feet by a share of `swing_lift`, 0 to 1, from the next support change on.

        Beside other robots and posts a low foot pushes where a high one treads on things.

        Raises:
            NaoGaitError: The share is not from 0 to 1.
        """
        share = Number(0.0, 1.0, "of swing_lift").check("lift", share)
        if share != self._lift_share:
            self._lift_share = share
            self.set_parameters(self.parameters)

    def request_kick(
        self, ball: Given[Point2], direction: Given[float], radius: Given[float] = BALL
    ) -> None:
        """Kick a ball in the walk, with the next foot whose way it lies on; see `StepKick`.

        Args:
            ball: x, y [m] in base_footprint of the last frame. Ask anew for each new percept: a
                request waits 0.5 s for a step that fits, and is then forgotten.
            direction: Where it shall go [rad], counter-clockwise from straight ahead.
            radius: Of the ball [m].

        Raises:
            NaoGaitError: A number is not finite.
        """
        x, y = read_array(ball, "kick.ball", (2,), 100.0, "m").tolist()
        towards = Number(-100.0, 100.0, "rad").check("kick.direction", direction)
        size = Number(0.0, 1.0, "m").check("kick.radius", radius)
        base = self._estimator.odometry.base_footprint_in_odom
        length = self._size.length
        self._step_kick.ask(compose(base, (x / length, y / length, towards)), size / length)

    # -- status ------------------------------------------------------------------------------------

    @property
    def parameters(self) -> GaitParameters:
        """The parameters, with a change that waits for the next support change."""
        return self._pending or self._parameters

    @property
    def mass(self) -> float:
        """Mass [kg] of the robot."""
        return self._body.total_mass

    @property
    def state(self) -> GaitState:
        """Current mode."""
        return self._modes.state

    def corrected(self, frame: Given[SensorFrame]) -> SensorFrame:
        """The frame without the constant errors that are known."""
        check_inputs(frame, STANDSTILL, self._joints)
        return self._correction.sensed(frame)

    @property
    def support(self) -> int:
        """Support leg at the time of the last frame, LEFT or RIGHT."""
        return self._walk.estimated.support

    @property
    def calibration(self) -> Calibration:
        """The constant errors of the sensors, by all that has been measured so far."""
        c, stand = self._calibration, self._alignment
        gyro = self._size.rates(stand.gyro)
        return Calibration(
            sole_pitch=self.levelling.pitch,
            sole_roll=self.levelling.roll,
            lean=self.levelling.lean,
            imu_roll=c.imu_roll + stand.roll,
            imu_pitch=c.imu_pitch + stand.pitch,
            gyro_bias_x=c.gyro_bias_x + gyro[0],
            gyro_bias_y=c.gyro_bias_y + gyro[1],
            gyro_bias_z=c.gyro_bias_z + gyro[2],
            joint_zero=c.joint_zero,
        )

    @property
    def stand_time(self) -> float:
        """Duration [s] of the present quiet stand, as far as the calibration uses it."""
        return self._alignment.time * self._size.time

    @property
    def gyro_bias_sigma(self) -> float:
        """Standard deviation [rad/s] of the gyro's bias; it is learned while the robot stands."""
        return self._estimator.gyro_bias_sigma / self._size.time

    @property
    def heading_drift_sigma(self) -> float:
        """Standard deviation [rad/s] by which a held heading drifts because of the gyro's bias."""
        return self._estimator.heading_drift_sigma / self._size.time

    @property
    def torso_pose(self) -> Pose6:
        """The torso in base_footprint: x, y, z [m], roll, pitch, yaw [rad]; after a tick only."""
        return self._size.pose(self._estimator.torso_place.in_footprint())

    @property
    def motion_waits(self) -> bool:
        """A requested motion or get-up has not begun yet."""
        motions = self._modes.motions
        gets_up = motions.get_up_wanted and motions.attempts < ATTEMPTS
        return motions.waiting is not None or gets_up

    @property
    def gets_up_again(self) -> bool:
        """A lying robot is going to get up, or to try it once more."""
        motions = self._modes.motions
        wanted = motions.get_up_wanted or self._parameters.get_up
        return wanted and motions.attempts < ATTEMPTS

    @property
    def motion_ended(self) -> bool:
        """No motion runs, or the last keyframe is held."""
        return self._modes.motions.finished

    @property
    def status(self) -> GaitStatus:
        """State of the gait after the last tick."""
        running = self._modes.motions.running
        return self._size.status(make_status(
            self._stamp or 0,
            self._modes.state,
            self._walk,
            self._estimator,
            self._targets,
            com_height=self._parameters.com_height,
            ik_residual=self._residual,
            clipped_joints=self._clipped,
            motion="" if running is None else running.name,
            blocked=self._estimator.blocked is not None,
        ))  # fmt: skip
