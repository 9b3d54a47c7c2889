"""The walk of the paper: corrected pendulums, predicted over the delay, step after step.

Two times matter. Measurements are old, commands take effect later; what lies between has been sent
to the joints and cannot be changed. That piece is kept as a queue of committed segments:

    observed state --(committed segments: eq 21)--> predicted state --(plan)--> next segment

The observer corrects the observed state, the planner re-determines the pendulum from the predicted
one, and each tick commits one control period more.
"""

from collections import deque
from itertools import chain

from nao_lipm_gait.geometry import compose, relative
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import LEFT, RIGHT, Pose2, VelocityCommand
from nao_lipm_gait.walks.base import BodyTargets, Expectation, SoleTarget
from nao_lipm_gait.walks.lipm.com_observer import ComObserver
from nao_lipm_gait.walks.lipm.single_support import SHORTEST_PIECE, Phase, SingleSupport
from nao_lipm_gait.walks.lipm.stopping import can_come_to_rest, come_to_rest, is_at_rest
from nao_lipm_gait.walks.lipm.walk_state import (
    NextSupport,
    Segment,
    WalkState,
    follow,
    velocity_gained,
)
from nao_lipm_gait.walks.pendulum import divergent_component, natural_frequency
from nao_lipm_gait.walks.steps import (
    STEP_IN_PLACE,
    Pace,
    approach,
    limit_share,
    passing_speed,
    stride_for,
)
from nao_lipm_gait.walks.swing_foot import SwingFoot

FEET_TOGETHER = 0.015
"""[m, rad] a step size that leaves the feet nearly side by side: good enough to stand on."""
PUSH_LASTS = 0.03
"""[s] for which a push to the side that is felt now is expected to go on."""
PATIENCE = 8
"""Steps in place after which a stop no longer waits for the feedback to agree."""


class LipmWalk:
    """Omnidirectional walk on alternating inverted pendulums without double support."""

    def __init__(self, parameters: GaitParameters, control_period: float):
        self._dt = control_period
        self._observer_settings: tuple[float, ...] | None = None
        self._delay_ticks = max(0, round(parameters.feedback_delay / control_period))
        self.set_parameters(parameters)
        self.stand_at((0.0, 0.0, 0.0))

    def set_parameters(self, parameters: GaitParameters) -> None:
        """New parameters from the next plan on; the delay is fixed at construction."""
        self._p = p = parameters
        self._k = natural_frequency(p.pendulum_height)
        self._single_support = SingleSupport(p, self._k)
        settings = (
            p.position_sigma, p.velocity_sigma, p.measurement_sigma, p.offset_time, p.push_velocity
        )  # fmt: skip
        if settings != self._observer_settings:
            # Only then: what it has learned of the robot is worth keeping.
            self._observer_settings = settings
            self._observer = ComObserver(*settings)

    def stand_at(self, q_in_odom: Pose2) -> None:
        """Forget all motion: both feet side by side, the CoM at rest between them."""
        self._rest(LEFT, self._home_sole(LEFT), self._home_sole(RIGHT), q_in_odom)
        self._stopping = True

    def _rest(self, support: int, left_sole: Pose2, right_sole: Pose2, q_in_odom: Pose2) -> None:
        """The CoM at rest in the middle of Q, the soles where they are in Q."""
        carrying, other = (
            (left_sole, right_sole) if support == LEFT else (right_sole, left_sole)
        )
        rest = WalkState(support, 0.0, 0.0, 0.0, 0.0, carrying, q_in_odom, 0)
        self._observed = self._expected = self._predicted = self._before = rest
        still = (Segment(self._dt, 0.0, 0.0),)
        self._committed: deque[tuple[Segment, ...]] = deque([still] * self._delay_ticks)
        self._stride = STEP_IN_PLACE
        self._reserve = 1.0
        self._passing = 0.0
        self._pace = Pace()
        self._step_size: Pose2 = (0.0, 0.0, 0.0)
        self._last_step_size: Pose2 = (0.0, 0.0, 0.0)
        self._origin = (0.0, 0.0)
        self._swing = self._swing_foot(other, lift=0.0)
        self._steps_in_place = 0
        self._unobserved = 0
        self._elapsed = 0.0
        self._time_left = 0.0
        self._shifting_weight = False

    # -- the three stages of a tick ----------------------------------------------------------------

    def start(self, command: VelocityCommand) -> None:
        """Let the CoM fall from the middle towards the first support foot: no ramp is needed."""
        # The foot that leads the asked motion makes the first step; it carries the fall before.
        leads_left = command.y > 0.0 or (command.y == 0.0 and command.yaw > 0.0)
        soles = self._predicted.sole_in_q, self._swing.pose_in_q
        left_sole, right_sole = soles if self._predicted.support == LEFT else reversed(soles)
        self._rest(
            LEFT if leads_left else RIGHT, left_sole, right_sole, self._predicted.q_in_odom
        )
        self._stopping = False
        self._shifting_weight = True

    def catch(self, x: float, y: float, vx: float, vy: float) -> None:
        """Step out of a stand; the foot that the CoM leaves swings first. State in Q [m, m/s]."""
        self.start(VelocityCommand(0.0, divergent_component(y, vy, self._k), 0.0))
        tipping = self._observed.moved(x, y, vx, vy)
        self._observed = self._expected = self._predicted = self._before = tipping
        # Until now both feet have pushed back as far as the soles reach.
        pushed = Segment(self._dt, *come_to_rest(tipping, self._k, self._p))
        self._committed = deque([(pushed,)] * self._delay_ticks)
        self._swing = self._swing_foot(self._swing.pose_in_q, self._p.swing_lift)
        self._shifting_weight = False

    def expect(self) -> Expectation:
        """x_e of eq (10): the committed pendulum, one control period on."""
        self._before = self._observed
        if self._committed:
            self._observed = follow(self._observed, self._committed.popleft(), self._k)
        self._expected = self._observed
        self._unobserved += 1
        return Expectation(
            self._observed.support, (self._observed.x, self._observed.y), self._observed.sole_in_q
        )

    def observe(
        self, measured_x: float, measured_y: float, acceleration: tuple[float, float] | None = None
    ) -> None:
        """Eqs (11)-(14); standing with both feet there is no pendulum to correct."""
        missed, self._unobserved = self._unobserved > 1, 0
        if self._p.feedback and not self._stopping:
            felt = None
            if acceleration is not None:
                gained_x, gained_y = velocity_gained(self._before, self._expected)
                felt = acceleration[0] - gained_x / self._dt, acceleration[1] - gained_y / self._dt
            self._observed = self._observer.correct(
                self._expected,
                measured_x,
                measured_y,
                self._dt,
                missed,
                forward_speed=self._k * self._passing,
                felt=felt,
            )

    def plan(self, command: VelocityCommand) -> BodyTargets:
        """Predict over the delay (21), say where the body shall be then, plan what comes after."""
        state = follow(self._observed, chain.from_iterable(self._committed), self._k)
        self._predicted = state
        targets = self._targets(state)
        self._committed.append(tuple(self._next_period(self._pushed_on(state), command)))
        return targets

    # -- planning ----------------------------------------------------------------------------------

    def _pushed_on(self, state: WalkState) -> WalkState:
        """The state once a push to the side has gone on for a while.

        Which foot stands where, and when, is decided but once a step. Along x the pendulum origin
        answers all the time, so that nothing has to be guessed there.
        """
        more = PUSH_LASTS * self._observer.push_acceleration_y
        if more == 0.0 or self._stopping:
            return state
        return state.moved(state.x, state.y + 0.5 * PUSH_LASTS * more, state.vx, state.vy + more)

    def _next_period(self, state: WalkState, command: VelocityCommand) -> list[Segment]:
        """The segments of the next control period, with the support change where it is due."""
        segments: list[Segment] = []
        left = self._dt
        while left > SHORTEST_PIECE:
            if self._stopping:
                self._origin = come_to_rest(state, self._k, self._p)
                segments.append(Segment(left, *self._origin))
                break
            self._plan_single_support(state)
            duration = min(left, self._time_left)
            if not self._shifting_weight:
                self._swing.move_towards(self._landing(state.support), duration, self._time_left)
            self._elapsed += duration
            self._time_left -= duration
            left -= duration
            change = None
            if self._time_left <= SHORTEST_PIECE:
                sole_in_next_q = relative(self._swing.pose_in_q, self._step_size)
                change = NextSupport(self._step_size, sole_in_next_q)
            segments.append(Segment(duration, *self._origin, change))
            if change is not None:
                before, state = state, follow(state, segments[-1:], self._k)
                self._change_support(before, state, command)
        return segments

    def _plan_single_support(self, state: WalkState) -> None:
        phase = Phase(
            self._stride.of_step(-state.support, self._p),
            self._passing,
            self._elapsed,
            self._last_step_size[0],
            self._origin[0],
            self._shifting_weight,
        )
        plan = self._single_support.plan(state, phase)
        self._time_left, self._origin, self._step_size = plan.time, plan.origin, plan.step_size

    def _landing(self, support: int) -> Pose2:
        """Where the swing sole shall stand, in Q: at home in Q-bar."""
        return compose(self._step_size, self._home_sole(-support))

    def _change_support(
        self, before: WalkState, state: WalkState, command: VelocityCommand
    ) -> None:
        """The other leg carries; what was the support foot swings from where it stood."""
        p = self._p
        in_place = self._stride.is_zero and not self._shifting_weight
        self._steps_in_place = self._steps_in_place + 1 if in_place else 0
        feet_together = max(map(abs, self._step_size)) < FEET_TOGETHER
        enough = feet_together or self._steps_in_place >= PATIENCE
        self._stopping = (
            command.is_zero and in_place and enough and can_come_to_rest(state, self._k)
        )
        if not self._shifting_weight:
            self._pace.add(self._elapsed, self._stride, p)
        wanted = stride_for(command, p, self._pace.share)
        self._stride = approach(self._stride, wanted, p)
        self._reserve = 1.0 - limit_share(self._stride, p)  # once a step, not once a tick
        self._passing = passing_speed(self._stride, p)
        self._swing = self._swing_foot(
            relative(before.sole_in_q, self._step_size), 0.0 if self._stopping else p.swing_lift
        )
        self._last_step_size = self._step_size
        self._elapsed = 0.0
        self._time_left = 0.0
        self._shifting_weight = False

    def _home_sole(self, side: int) -> Pose2:
        """Where a sole stands in its Q: the optimal origin (r_x = 0) lies ahead of the ankle."""
        return -self._p.foot_reference_x, side * 0.5 * self._p.foot_spacing, 0.0

    def _swing_foot(self, start: Pose2, lift: float) -> SwingFoot:
        p = self._p
        return SwingFoot(start, lift, p.swing_rise, p.swing_travel_end, p.swing_toe_lift)

    # -- what is seen from outside -----------------------------------------------------------------

    def _targets(self, state: WalkState) -> BodyTargets:
        p = self._p
        support_sole = SoleTarget(state.sole_in_q[0], state.sole_in_q[1], 0.0, state.sole_in_q[2])
        x, y, yaw = self._swing.pose_in_q
        swing_sole = SoleTarget(x, y, self._swing.height, yaw, self._swing.pitch)
        left, right = (
            (support_sole, swing_sole) if state.support == LEFT else (swing_sole, support_sole)
        )
        return BodyTargets(
            com_in_q=(state.x, state.y, p.com_height),
            left_sole=left,
            right_sole=right,
            torso_roll=0.0,
            torso_pitch=p.torso_pitch,
            q_in_odom=state.q_in_odom,
        )

    @property
    def finished(self) -> bool:
        """True once the stop has brought the CoM to rest, also on the side of the measurements."""
        return self._stopping and is_at_rest(self._predicted) and is_at_rest(self._observed)

    @property
    def stopping(self) -> bool:
        return self._stopping

    @property
    def estimated(self) -> WalkState:
        """The observed state after the correction, at the time of the measurement."""
        return self._observed

    @property
    def expected(self) -> WalkState:
        return self._expected

    @property
    def predicted(self) -> WalkState:
        return self._predicted

    @property
    def origin_in_q(self) -> tuple[float, float]:
        return self._origin

    @property
    def step_size(self) -> Pose2:
        return self._step_size

    @property
    def reserve(self) -> float:
        return self._reserve

    @property
    def time_left(self) -> float:
        return self._time_left
