"""The walk of the first paper: corrected pendulums, predicted over the delay, step after step.

Measurements are old and commands take effect later. The motion in between has been sent to the
joints and cannot be changed. It is kept as a queue of committed segments:

    observed state --(committed segments: eq 21)--> predicted state --(plan)--> next segment

The observer corrects the observed state, eqs (10)-(14). The planner recomputes the pendulum
from the predicted state, eqs (3)-(9) and (15)-(20). Each tick commits one control period more.
"""

from collections import deque
from collections.abc import Callable
from itertools import chain, islice

from nao_lipm_gait.walks.base import BodyTargets, Expectation, SoleTarget, body_targets
from nao_lipm_gait.walks.lipm.com_observer import ComObserver
from nao_lipm_gait.walks.lipm.extensions.disturbances import (
    MeasurementOffset,
    PushDetector,
    unexplained_acceleration,
)
from nao_lipm_gait.walks.lipm.extensions.motor_limit import MotorLimit
from nao_lipm_gait.walks.lipm.extensions.stopping import can_stop, is_at_rest, stopping_origin
from nao_lipm_gait.walks.lipm.extensions.sway_limit import SwayLimit
from nao_lipm_gait.walks.lipm.kalman_observer import kalman_observer
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from nao_lipm_gait.walks.lipm.single_support import TIME_MIN, SingleSupport, StepRequest
from nao_lipm_gait.walks.lipm.state import NextSupport, Segment, WalkState, follow
from nao_lipm_gait.walks.lipm.steady_walk import Pace, limit_share, passing_speed, stride_for
from nao_lipm_gait.walks.pendulum import divergent_component, natural_frequency
from nao_lipm_gait.walks.steps import (
    STEP_IN_PLACE,
    approach,
    closer_soles,
    first_support,
    home_sole,
)
from nao_lipm_gait.walks.swing_foot import SwingFoot
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose, relative
from robot_core.types import LEFT, RIGHT, Pose2, VelocityCommand

FEET_TOGETHER = 0.015
"""Largest step size [m, rad] after which the feet are side by side well enough to stand."""
PUSH_TIME = 0.03
"""Time for which a push that acts now is expected to continue [s]."""
STEPS_IN_PLACE_MAX = 8
"""Steps in place after which a stop no longer waits for the feet to be side by side."""
CATCH_UP = 2
"""Control periods in which the motors catch up with the targets after they have held older ones."""


class LipmWalk:
    """Omnidirectional walk on alternating inverted pendulums without double support.

    Args:
        parameters: Parameters of the gait; `feedback_delay` is fixed from here on.
        control_period: Time between two ticks [s].
        make_observer: Makes the CoM observer from the parameters.
    """

    def __init__(
        self,
        parameters: LipmParameters,
        control_period: float,
        make_observer: Callable[[LipmParameters], ComObserver] = kalman_observer,
    ):
        self._dt = control_period
        self._make_observer = make_observer
        self._observer_settings: tuple[float, ...] | None = None
        self.delay_ticks = max(0, round(parameters.feedback_delay / control_period))
        self.hip_lag: float | None = None
        self._motors = MotorLimit(parameters.hip_lag_max)
        self._sway = SwayLimit(parameters.sway_limit)
        self.set_parameters(parameters)
        self.stand_at((0.0, 0.0, 0.0))

    def set_parameters(self, parameters: LipmParameters) -> None:
        """Use new parameters from the next plan on; `delay_ticks` stays."""
        self._p = p = parameters
        self._wanted_step: Pose2 | None = None
        self._k = natural_frequency(p.pendulum_height)
        self._single_support = SingleSupport(p, self._k)
        self._sway.set_limit(p.sway_limit)
        self._motors.set_limit(p.hip_lag_max)
        settings = (p.position_sigma, p.velocity_sigma, p.offset_time, p.push_velocity)
        if settings != self._observer_settings:
            # Other changes keep what has been learned about the robot.
            self._observer_settings = settings
            observer = self._make_observer(p)
            if not (hasattr(observer, "predict") and hasattr(observer, "correct")):
                allowed = "a function that returns an object with predict and correct"
                raise NaoGaitError("make_observer", observer, allowed)
            self._observer = observer
            self._offset = MeasurementOffset(p.offset_time)
            self._push_detector = PushDetector(p.push_velocity)

    def stand_at(self, q_in_odom: Pose2) -> None:
        """Reset to a stand: both feet side by side, the CoM at rest between them."""
        self._rest(LEFT, home_sole(LEFT, self._p), home_sole(RIGHT, self._p), q_in_odom)
        self.stopping = True

    def _rest(self, support: int, left_sole: Pose2, right_sole: Pose2, q_in_odom: Pose2) -> None:
        """The CoM at rest in the middle of Q; the soles are given in Q."""
        carrying, other = (left_sole, right_sole) if support == LEFT else (right_sole, left_sole)
        rest = WalkState(support, 0.0, 0.0, 0.0, 0.0, carrying, q_in_odom, 0)
        self.estimated = self.expected = self.predicted = self._before = rest
        still = (Segment(self._dt, 0.0, 0.0),)
        self._committed: deque[tuple[Segment, ...]] = deque([still] * self.delay_ticks)
        self._sent: deque[bool] = deque([True] * self.delay_ticks)
        self._followed = CATCH_UP + 1
        self._stride = STEP_IN_PLACE
        self._wanted_step = None
        self.reserve = 1.0
        self._passing = 0.0
        self._pace = Pace()
        self._last_wanted_step: Pose2 = (0.0, 0.0, 0.0)
        self.step_size: Pose2 = (0.0, 0.0, 0.0)
        self._last_step_size: Pose2 = (0.0, 0.0, 0.0)
        self.origin_in_q = (0.0, 0.0)
        self._swing = self._swing_foot(other, 0.0)
        self._swing_target = SoleTarget(other[0], other[1], 0.0, other[2])
        self._torso_yaw = 0.0
        self._steps_in_place = 0
        self._sway.begin()
        self._motors.begin(self.hip_lag)
        self._unobserved = 0
        self._elapsed = 0.0
        self.time_left = 0.0
        self._shifts_weight = False

    def start(self, command: VelocityCommand, inward: float = 0.0) -> None:
        """Let the CoM fall from the middle towards the first support foot: no ramp is needed."""
        soles = self.predicted.sole_in_q, self._swing.pose_in_q
        left_sole, right_sole = soles if self.predicted.support == LEFT else soles[::-1]
        left_sole, right_sole = closer_soles(left_sole, right_sole, inward)
        self._rest(first_support(command), left_sole, right_sole, self.predicted.q_in_odom)
        self.stopping = False
        self._shifts_weight = True

    def catch(self, x: float, y: float, vx: float, vy: float) -> None:
        """Step from a stand that tips, see `Walk`; the foot that the CoM moves to swings first."""
        self.start(VelocityCommand(0.0, divergent_component(y, vy, self._k), 0.0))
        tipping = self.estimated.moved(x, y, vx, vy)
        self.estimated = self.expected = self.predicted = self._before = tipping
        # Until now both feet have pushed back as far as the soles reach.
        pushed = Segment(self._dt, *stopping_origin(tipping, self._k, self._p))
        self._committed = deque([(pushed,)] * self.delay_ticks)
        self._sent = deque([True] * self.delay_ticks)
        self._swing = self._swing_foot(self._swing.pose_in_q, self._p.swing_lift)
        self._shifts_weight = False

    # -- the three stages of a tick ----------------------------------------------------------------

    def expect(self) -> Expectation:
        """x_e of eq (10): the committed pendulum, one control period on."""
        self._before = self.estimated
        if self._committed:
            self.estimated = follow(self.estimated, self._committed.popleft(), self._k)
            self._followed = self._followed + 1 if self._sent.popleft() else 0
        self.expected = expected = self.estimated
        self._unobserved += 1
        self._motors.update(self.hip_lag, self._dt)
        # The step that has just been measured ended one delay ago: before the one that is planned.
        return Expectation(
            expected.support, (expected.x, expected.y), expected.sole_in_q, self._last_wanted_step
        )

    def observe(
        self, measured_x: float, measured_y: float, acceleration: tuple[float, float] | None = None
    ) -> None:
        """Correct the state by a measurement, eqs (11)-(14); see `Walk`."""
        if self._followed <= CATCH_UP:
            return  # the joints did not follow the walk
        missed, self._unobserved = self._unobserved > 1, 0
        if self.stopping or not self._p.feedback:
            return  # with both feet on the ground there is no pendulum to correct
        expected, dt = self.expected, self._dt
        dx, dy = measured_x - expected.x, measured_y - expected.y  # (11)
        dx, dy = self._offset.remove(dx, dy, dt)
        self._sway.update(dy, dt)
        self._observer.predict(expected, dt)  # (12)
        correction = self._observer.correct(dx, dy)  # (13), (14)
        if acceleration is not None:
            acceleration = unexplained_acceleration(self._before, expected, acceleration, dt)
        push_x, push_y = self._push_detector.update(
            (dx, dy),
            correction,
            self._k * self._passing,
            dt,
            expected.step_count,
            missed,
            acceleration,
        )
        self.estimated = expected.moved(
            expected.x + correction.x,
            expected.y + correction.y,
            expected.vx + (correction.vx + push_x),
            expected.vy + (correction.vy + push_y),
        )

    def plan(self, command: VelocityCommand, *, sent: bool = True) -> BodyTargets:
        """Predict over the delay (21); the targets are for then, the plan for what comes after."""
        state = follow(self.estimated, chain.from_iterable(self._committed), self._k)  # (21)
        self.predicted = state
        x, y, yaw = self._swing.pose_in_q
        self._swing_target = SoleTarget(x, y, self._swing.height, yaw, self._swing.pitch)
        # The torso turns at a constant rate: it is not braked and driven anew in every step, which
        # the friction of one sole would have to do.
        self._torso_yaw = 0.5 * self._swing.yaw_behind
        self._committed.append(tuple(self._next_period(self._after_push(state), command)))
        self._sent.append(sent)
        return self._targets(state)

    def lengthen(self, ahead: float) -> None:
        """See `Walk`; a step of its own limit gets no longer."""
        x, y, yaw = self._wanted_step or self._stride.of_step(-self.predicted.support, self._p)
        self._wanted_step = min(x + ahead, max(x, self._p.step_forward_max)), y, yaw

    def replan(self) -> BodyTargets:
        """The targets of the last `plan` again, from the state as it is observed now."""
        sent = islice(self._committed, max(0, len(self._committed) - 1))
        self.predicted = follow(self.estimated, chain.from_iterable(sent), self._k)
        return self._targets(self.predicted)

    def _targets(self, state: WalkState) -> BodyTargets:
        return body_targets(
            state.support,
            (state.x, state.y, self._p.com_height),
            state.sole_in_q,
            self._swing_target,
            self._p,
            state.q_in_odom,
            self._torso_yaw,
        )

    # -- planning ----------------------------------------------------------------------------------

    def _after_push(self, state: WalkState) -> WalkState:
        """The state once a push to the side has continued for `PUSH_TIME`.

        When the support changes, and where the next foot is in y, is decided once per step. In x
        the pendulum origin answers in every tick, so no push has to be predicted there.
        """
        gain = PUSH_TIME * self._push_detector.lateral_acceleration
        if gain == 0.0 or self.stopping:
            return state
        return state.moved(state.x, state.y + 0.5 * PUSH_TIME * gain, state.vx, state.vy + gain)

    def _next_period(self, state: WalkState, command: VelocityCommand) -> list[Segment]:
        """The segments of the next control period, with the support change where it is due."""
        segments: list[Segment] = []
        left = self._dt
        while left > TIME_MIN:
            if self.stopping:
                self.origin_in_q = stopping_origin(state, self._k, self._p)
                segments.append(Segment(left, *self.origin_in_q))
                break
            self._plan_single_support(state)
            duration = min(left, self.time_left)
            if not self._shifts_weight:
                # The swing sole lands where it stands in Q-bar.
                landing = compose(self.step_size, home_sole(-state.support, self._p))
                self._swing.move_towards(landing, duration, self.time_left)
            self._elapsed += duration
            self.time_left -= duration
            left -= duration
            change = None
            if self.time_left <= TIME_MIN:
                sole_in_next_q = relative(self._swing.pose_in_q, self.step_size)
                change = NextSupport(self.step_size, sole_in_next_q)
            segments.append(Segment(duration, *self.origin_in_q, change))
            if change is not None:
                before, state = state, follow(state, segments[-1:], self._k)
                self._change_support(before, state, command)
        return segments

    def _plan_single_support(self, state: WalkState) -> None:
        if self._wanted_step is None:
            self._wanted_step = self._stride.of_step(-state.support, self._p)
        request = StepRequest(
            self._wanted_step,
            self._passing,
            self._elapsed,
            self._last_step_size[0],
            self.origin_in_q[0],
            self._shifts_weight,
        )
        plan = self._single_support.plan(state, request)
        self.time_left, self.origin_in_q, self.step_size = plan.time, plan.origin, plan.step_size

    def _change_support(
        self, before: WalkState, state: WalkState, command: VelocityCommand
    ) -> None:
        """The other leg supports; the old support foot starts to swing from where it stood."""
        p = self._p
        in_place = self._stride.is_zero and not self._shifts_weight
        self._steps_in_place = self._steps_in_place + 1 if in_place else 0
        feet_together = max(map(abs, self.step_size)) < FEET_TOGETHER
        enough = feet_together or self._steps_in_place >= STEPS_IN_PLACE_MAX
        self.stopping = command.is_zero and in_place and enough and can_stop(state, self._k)
        if not self._shifts_weight:
            self._pace.add(self._elapsed, self._stride, p)
        wanted = stride_for(command, p, self._pace.share)
        forward_share, _, _ = wanted.used_shares(p)
        allowed = self._sway.share
        if self._motors.step_max < p.step_forward_max:
            allowed = min(allowed, self._motors.step_max / p.step_forward_max)
        held = forward_share > allowed
        if held:
            wanted = wanted.scaled(allowed / forward_share)
        self._stride = approach(self._stride, wanted, p)
        forward_share, _, _ = self._stride.used_shares(p)
        self._sway.watch(forward_share)
        self._last_wanted_step = self._wanted_step or self.step_size
        self._wanted_step = None
        # What holds the speed must not grow while something else than the command sets the stride.
        self.reserve = 0.0 if held else 1.0 - limit_share(self._stride, p)
        self._passing = passing_speed(self._stride, p)
        self._swing = self._swing_foot(
            relative(before.sole_in_q, self.step_size), 0.0 if self.stopping else p.swing_lift
        )
        self._last_step_size = self.step_size
        self._elapsed = 0.0
        self.time_left = 0.0
        self._shifts_weight = False

    def _swing_foot(self, start: Pose2, lift: float) -> SwingFoot:
        p = self._p
        return SwingFoot(start, lift, p.swing_rise, p.swing_travel_end, p.swing_toe_lift)

    # -- state for status and diagnostics ----------------------------------------------------------

    @property
    def watches_hips(self) -> bool:
        """See `Walk`."""
        return self._p.hip_lag_max > 0.0

    @property
    def finished(self) -> bool:
        """Whether a stop has brought the CoM to rest, in the observed state too."""
        return self.stopping and is_at_rest(self.predicted) and is_at_rest(self.estimated)

    @property
    def com_ahead(self) -> float:
        """Measured minus planned CoM on average, forward [m], times `lean_torque`."""
        return self._p.lean_torque * self._offset.x
