"""The gait: one sensor frame in, joint targets out, a straight line of stages.

    SensorFrame -> torso orientation -> measured CoM -> CoM observer (10-14) -> prediction (21)
     -> corrected pendulum (15-20) -> support change and step plan (3-9) -> body targets
     -> inverse kinematics -> posture feedback -> joint limits -> JointTargets

Deterministic: no clock, no I/O, no globals; the same frames give the same targets.
"""

from collections.abc import Sequence

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.estimation.state_estimator import StateEstimator
from nao_lipm_gait.head.gaze import PAN, TILT
from nao_lipm_gait.head.goals import Goal
from nao_lipm_gait.head.head_control import HeadControl
from nao_lipm_gait.motion.groups import BODY, joint_groups
from nao_lipm_gait.motion.keyframes import LYING, Motion, Posture
from nao_lipm_gait.motion.library import MotionLibrary
from nao_lipm_gait.motion.scheduler import ATTEMPTS, MotionScheduler
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.rate_limiter import EasedPose, HeadingLean
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.status import snapshot
from nao_lipm_gait.types import (
    BUSY,
    DOWN,
    FALLEN,
    GETTING_UP,
    IN_MOTION,
    MOTION,
    ON_THE_WAY,
    RELAXED,
    STAND,
    STANDSTILL,
    STOP,
    WALK,
    FloatArray,
    GaitState,
    GaitStatus,
    JointTargets,
    Pose2,
    SensorFrame,
    VelocityCommand,
)
from nao_lipm_gait.velocity_control import HeadingHold, SpeedHold
from nao_lipm_gait.walks.base import BodyTargets
from nao_lipm_gait.walks.registry import make_walk
from nao_lipm_gait.whole_body.body_model import BodyModel
from nao_lipm_gait.whole_body.com_placement import ComPlacement
from nao_lipm_gait.whole_body.joint_limits import JointLimits
from nao_lipm_gait.whole_body.legs import make_legs
from nao_lipm_gait.whole_body.posture_feedback import PostureFeedback
from nao_lipm_gait.whole_body.stand_blend import StandBlend
from nao_lipm_gait.whole_body.tilt_compensation import TiltCompensation

MISSED_TICKS_MAX = 20
"""A longer gap between two frames is a time jump: the gait starts anew."""
UPRIGHT_TILT = 0.2
"""[rad] below which a fallen robot counts as put back on its feet."""
UPRIGHT_TIME = 0.5
"""[s] for which it must stay there."""
NOWHERE: Pose2 = (0.0, 0.0, 0.0)


class Gait:
    """Makes one robot walk; see the module for its stages."""

    def __init__(
        self,
        robot: RobotDescription,
        parameters: GaitParameters,
        control_period: float = 0.01,
        motions: MotionLibrary | None = None,
    ):
        """control_period [s]: the distance of two sensor frames; motions: None = the shipped ones
        of this robot, which are read when the first of them is asked for.
        """
        self.robot = robot
        self._motions = motions
        self._parameters = parameters
        self._dt = self._passed = control_period
        self._period = round(control_period * 1e9)
        self._body = BodyModel(robot)
        self._limits = JointLimits(robot)
        self._pending: GaitParameters | None = None
        self._stand_requested = self._relax_requested = self._fall_told = self._resumes = False
        self._head = HeadControl(robot)
        self.reset()

    # -- what the world may ask --------------------------------------------------------------------

    def reset(self) -> None:
        """Forget everything; the next frame begins a stand from whatever pose it shows."""
        p = self._parameters = self._pending or self._parameters
        self._pending = None
        self._walk = make_walk(p, self._dt)
        self._placement = ComPlacement(self.robot, self._body, make_legs(self.robot))
        self._senses = StateEstimator(self._body, p, self._dt)
        self._posture = PostureFeedback(self.robot)
        self._tilt = TiltCompensation()
        self._heading_hold = HeadingHold()
        self._heading_lean = HeadingLean()
        self._speed_hold = SpeedHold()
        self._pose = EasedPose()
        self._conductor = MotionScheduler(self.robot, self._motions)
        self._head.rest()
        self._last_position: FloatArray | None = None
        self._state = STAND
        self._stamp: int | None = None
        self._blend = StandBlend()
        self._upright_time = 0.0
        self._residual = 0.0
        self._clipped = 0
        self._targets: BodyTargets | None = None
        self._last_command = STANDSTILL

    def begin_again(self) -> None:
        """Forget what was sensed, as after a gap; the next frame begins anew. Nobody is made stiff
        by it: who is limp or lies stays so, who is getting up tries again, who sits remains seated.
        """
        state, conductor, position = self._state, self._conductor, self._last_position
        self.reset()
        if state is RELAXED:
            self.request_relax()
        elif self._fall_told or state in (FALLEN, GETTING_UP):
            self.believe_fallen()
            self._conductor.get_up_wanted = conductor.get_up_wanted
        elif self._resumes or (state is MOTION and conductor.finished):
            # Also once more before the next frame, when the state already reads STAND.
            self._conductor, self._last_position = conductor, position
            self._resumes = True

    def go_on_at(self, stamp: int) -> None:
        """The clock of the frames has changed and nothing else: the next one is of this stamp."""
        if self._stamp is not None:
            self._stamp = stamp - self._period

    def believe_fallen(self) -> None:
        """Somebody else knows: the next tick is that of a fallen robot."""
        self._fall_told = True  # outlives a beginning anew, which that tick may be

    def request_stand(self) -> None:
        """Stop if walking; get stiff and stand if relaxed."""
        self._stand_requested = True

    def request_relax(self) -> None:
        """Take the torque off all joints at the next tick."""
        self._relax_requested = True

    def request_motion(self, motion: str | Motion) -> None:
        """Run a motion by its name, or `get_up`, or a motion that is in no library: at once, or
        when the walk or another motion has ended.

        NaoGaitError, with what is possible, for a motion that is unknown or cannot begin here.
        """
        self._conductor.request(motion, self._posture_ahead)

    def request_look(self, goal: Goal | None) -> None:
        """Turn the head, whatever the body does; None gives it back to the gait.

        NaoGaitError for a robot without a head to turn.
        """
        if not self._head.exists:
            raise NaoGaitError("head", "none", f"{PAN} and {TILT} in the robot's joints")
        self._head.ask(goal)

    def set_parameters(self, parameters: GaitParameters) -> None:
        """Change parameters, of a walk where it next changes its support foot.

        `NEEDS_RESET` ones take effect at the next reset.
        """
        if self._state in ON_THE_WAY:
            self._pending = parameters
        else:
            self._take_over(parameters)

    def _take_over(self, parameters: GaitParameters) -> None:
        self._pending = None
        self._parameters = parameters
        self._walk.set_parameters(parameters)
        self._senses.set_parameters(parameters)

    # -- the tick ----------------------------------------------------------------------------------

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        """One control tick. Frames must be finite; a stamp that goes back starts the gait anew."""
        missed = self._missed_ticks(frame)
        for _ in range(missed):
            # What was lost on the way still happened: the pendulum swings on unobserved.
            self._walk.expect()
            self._walk.plan(self._last_command)
        self._stamp = frame.stamp
        self._passed = (missed + 1) * self._dt

        expected = self._walk.expect()
        self._senses.update(
            frame,
            expected.support,
            expected.sole_in_q,
            self._state,
            self._passed,
            settled=self._settled,
        )
        self._change_state(frame, command)
        if self._is_down:
            return self._relaxed(frame)
        if self._state in IN_MOTION:
            return self._moved(frame)

        x, y, _ = self._senses.com_in_q
        self._walk.observe(x, y, self._senses.acceleration_in_q)
        walking = self._state is not STAND and not self._stops
        before = self._walk.predicted.support
        self._last_command = self._steered(command) if walking else STANDSTILL
        planned = self._pose.towards(self._walk.plan(self._last_command), self._passed)
        self._targets = self._leaned(planned, walking)
        if self._pending is not None and (
            self._walk.predicted.support != before or self._state not in ON_THE_WAY
        ):
            self._take_over(self._pending)
        if self._parameters.feedback and self._state in ON_THE_WAY:
            unwanted = (0.0, 0.0)
            if self._state is WALK:
                unwanted = self._senses.unwanted_tilt(self._targets.torso_pitch)
            self._targets = self._tilt.apply(
                self._targets,
                self._walk.predicted.support,
                unwanted,
                self._parameters,
                self._passed,
            )
        placed = self._placement.place(self._targets, self._parameters.arm_swing)
        position = self._blend.apply(
            placed.position, self._passed, self._parameters.stand_time
        )
        if self._parameters.feedback and self._state is WALK:
            self._posture.apply(
                position,
                self._walk.predicted.support,
                self._senses.angular_velocity,
                self._parameters,
                self._passed,
            )
        self._residual = placed.residual
        self._turn_head(position)
        self._clipped = self._limits.cut(position)
        self._last_position = position
        return JointTargets(frame.stamp, position)

    def _turn_head(self, position: FloatArray) -> None:
        if not self._head.is_free:
            self._head.apply(position, self._senses.place, self._passed)

    def _steered(self, command: VelocityCommand) -> VelocityCommand:
        p, odometry = self._parameters, self._senses.odometry
        if p.feedback and p.speed_time > 0.0:
            command = self._speed_hold.steered(
                command, odometry.velocity, self._walk.reserve, p.speed_time, self._passed
            )
        # Also called without feedback: a heading from before it was switched off is forgotten.
        gain = p.heading_gain if p.feedback else 0.0
        heading = odometry.base_footprint_in_odom[2]
        return self._heading_hold.steered(command, heading, gain, self._passed)

    def _leaned(self, targets: BodyTargets, walking: bool) -> BodyTargets:
        p = self._parameters
        needed = p.yaw_from_lean and not p.yaw_gyro and self._heading_hold.holds and walking
        lean = self._heading_lean.towards(p.heading_lean if needed else 0.0, self._passed)
        return targets.posed(targets.com_in_q, targets.torso_pitch + lean)

    def _missed_ticks(self, frame: SensorFrame) -> int:
        """Ticks without a frame since the last one; begins anew at a start or a time jump."""
        ticks = 0 if self._stamp is None else round((frame.stamp - self._stamp) / self._period)
        if self._stamp is not None and 1 <= ticks <= MISSED_TICKS_MAX:
            return ticks - 1
        if self._stamp is not None:
            self.reset()
        resumes, self._resumes = self._resumes, False
        wanted = self._conductor.get_up_wanted
        self._begin_stand(frame.joint_position)
        if self._senses.begin(frame) or self._fall_told:
            self._state = FALLEN
            self._conductor.forget_if_upright()
            self._conductor.get_up_wanted = wanted
        elif resumes:
            self._state = MOTION
            self._senses.watch_lying()
        return 0

    # -- motions -----------------------------------------------------------------------------------

    @property
    def _posture_ahead(self) -> Posture | None:
        """The robot's posture once the running motion has ended; None while it falls or is limp."""
        running = self._conductor.running
        if self._state in IN_MOTION and running is not None:
            return running.ends
        return self._senses.lying_side if self._is_down else Posture.STANDING

    @property
    def _stops(self) -> bool:
        return self._stand_requested or self._conductor.waiting is not None

    def _begin_motion(self, motion: Motion, start: FloatArray) -> None:
        self._walk.stand_at(NOWHERE)
        for _ in range(2):  # the placement leads the CoM by its last way; the second time at rest
            placed = self._placement.place(self._walk.plan(STANDSTILL))
        self._limits.cut(placed.position)
        self._conductor.begin(motion, start, placed.position)
        self._state = GETTING_UP if motion.gets_up else MOTION
        self._senses.watch_lying()

    def _moved(self, frame: SensorFrame) -> JointTargets:
        """Targets of the running motion."""
        targets = self._conductor.advance(self._passed, self._senses.angular_velocity)
        if self._conductor.turns_head:
            self._head.yield_to(targets.position)
        else:
            self._turn_head(targets.position)
        self._residual = 0.0
        self._clipped = self._limits.cut(targets.position)
        self._last_position = targets.position
        lowest = float(np.min(targets.stiffness))
        uniform = lowest == float(np.max(targets.stiffness))
        return JointTargets(
            frame.stamp, targets.position, lowest, None if uniform else targets.stiffness
        )

    def _change_in_motion(self, frame: SensorFrame) -> None:
        conductor = self._conductor
        running, position = conductor.running, self._last_position
        if running is None or position is None or not conductor.finished:
            return
        if running.ends in LYING or (running.gets_up and self._senses.lies_after_motion()):
            conductor.end()
            # Who lies down because he was asked to does not get up unasked.
            self._state = FALLEN if running.gets_up else RELAXED
            self._upright_time = 0.0
        elif conductor.waiting is not None:
            self._begin_motion(conductor.waiting, position)
        elif running.ends is Posture.STANDING:
            conductor.stop()
            # What kept its feet has left the robot in its stand; what got up has to settle.
            watched = () if running.gets_up else joint_groups(self.robot)[BODY]
            self._begin_stand(position, watched)
        elif self._stand_requested:
            way_up = conductor.library.between(running.ends, Posture.STANDING)
            if way_up is not None:
                self._begin_motion(way_up, position)

    def _get_up_motion(self) -> Motion | None:
        """What a fallen robot begins now, if anything."""
        conductor = self._conductor
        if conductor.waiting is not None:
            return conductor.waiting
        wanted = conductor.get_up_wanted or (self._parameters.get_up and not self._relaxed_by_hand)
        side = self._senses.lying_side
        if side is None or not wanted or conductor.attempts >= ATTEMPTS:
            return None
        conductor.attempts += 1
        return conductor.get_up_from(side)

    # -- states ------------------------------------------------------------------------------------

    @property
    def _lies_down(self) -> bool:
        """A motion runs that ends on the floor: a tilt is then no fall."""
        running = self._conductor.running
        return running is not None and not running.upright

    @property
    def _relaxed_by_hand(self) -> bool:
        return self._state is RELAXED

    @property
    def _settled(self) -> bool:
        """It stands in its stand pose."""
        return self._state is STAND and not self._blend.active

    @property
    def _is_down(self) -> bool:
        return self._state in DOWN

    def _falls(self) -> bool:
        """Told by somebody else, or felt; once per tick."""
        told, self._fall_told = self._fall_told, False
        return told or self._senses.falls()

    def _change_state(self, frame: SensorFrame, command: VelocityCommand) -> None:
        if self._relax_requested:
            self._state = RELAXED
            self._conductor.stop()
        elif self._state is GETTING_UP:
            self._change_in_motion(frame)
        elif self._is_down and (motion := self._get_up_motion()) is not None:
            self._begin_motion(motion, self._measured_pose(frame))
        elif self._falls() and not self._lies_down:
            self._conductor.forget_if_upright()
            if self._state is not RELAXED or self._stand_requested:
                # A lying robot that shall stand does so once it is upright again.
                self._state = FALLEN
            self._upright_time = 0.0
            self._heading_hold.release()
        elif self._state is RELAXED:
            if self._stand_requested:
                self._begin_stand(frame.joint_position)
        elif self._state is FALLEN:
            upright = self._senses.orientation.tilt < UPRIGHT_TILT
            self._upright_time = self._upright_time + self._passed if upright else 0.0
            if self._upright_time > UPRIGHT_TIME:
                self._begin_stand(frame.joint_position)
        elif self._state is MOTION:
            self._change_in_motion(frame)
        elif self._state is STAND:
            waiting = self._conductor.waiting
            if waiting is not None and self._settled:
                position = self._last_position
                self._begin_motion(
                    waiting, self._measured_pose(frame) if position is None else position
                )
            elif self._settled and (tipping := self._senses.tipping_com()) is not None:
                self._walk.catch(*tipping)
                self._set_out()
            elif not command.is_zero and self._settled and not self._stops:
                self._conductor.attempts = 0
                self._walk.start(command)
                self._set_out()
        elif self._walk.finished:
            self._state = STAND
        else:
            self._state = STOP if self._walk.stopping else WALK
        self._relax_requested = False
        if self._state is not STAND:
            self._senses.forget_stand()
        if self._state not in BUSY:
            self._stand_requested = False

    def _set_out(self) -> None:
        self._tilt = TiltCompensation()
        self._speed_hold.begin()
        self._state = WALK

    def _measured_pose(self, frame: SensorFrame) -> FloatArray:
        pose = np.array(frame.joint_position, dtype=float)
        self._limits.cut(pose)
        return pose

    def _begin_stand(self, position: FloatArray, watched: Sequence[int] = ()) -> None:
        """From this pose (n,) [rad]; watched: see `StandBlend.begin`."""
        self._state = STAND
        self._conductor.get_up_wanted = False
        self._walk.stand_at(NOWHERE)
        self._pose.begin_anew()
        self._blend.begin(position, watched)
        self._upright_time = 0.0

    def _relaxed(self, frame: SensorFrame) -> JointTargets:
        self._head.rest()
        position = np.array(frame.joint_position, dtype=float)
        self._limits.cut(position)
        self._residual = 0.0
        self._clipped = 0
        return JointTargets(frame.stamp, position, stiffness=0.0)

    # -- what is shown -----------------------------------------------------------------------------

    @property
    def mass(self) -> float:
        """[kg] of the robot."""
        return self._body.total_mass

    @property
    def state(self) -> GaitState:
        return self._state

    @property
    def status(self) -> GaitStatus:
        """A snapshot of the last tick."""
        running = self._conductor.running
        return snapshot(
            self._stamp or 0,
            self._state,
            self._walk,
            self._senses,
            self._targets,
            self._parameters.com_height,
            ik_residual=self._residual,
            clipped_joints=self._clipped,
            motion="" if running is None else running.name,
        )
