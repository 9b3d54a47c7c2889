"""The walk of the second paper: half strides of fixed duration, one after the other.

Nothing is measured. The trajectories of a half stride are fixed when it begins; only the posture
feedback, which acts on the joints, answers disturbances. Forward, sideways and turning motion are
superposed. Each half stride has its own Q between the feet, and the step size is the pose of the
next Q in this one. The CoM goes from half-way between the last Q and this one to half-way between
this one and the next, and sways about that line.
"""

from collections import deque
from enum import Enum
from math import cos, sin
from typing import NamedTuple

from nao_lipm_gait.walks.base import BodyTargets, Expectation, SoleTarget, body_targets
from nao_lipm_gait.walks.pendulum import natural_frequency
from nao_lipm_gait.walks.steps import (
    STEP_IN_PLACE,
    Stride,
    approach,
    asked_stride,
    closer_soles,
    ellipsoid_share,
    first_support,
    home_sole,
    within_limits,
)
from nao_lipm_gait.walks.swing_foot import raised_cosine
from nao_lipm_gait.walks.zmp.parameters import ZmpParameters
from nao_lipm_gait.walks.zmp.trajectories import (
    entry_speed,
    lift,
    sway,
    swing_in,
    swing_out,
    travel,
)
from robot_core.geometry import compose, relative
from robot_core.types import LEFT, RIGHT, Pose2, VelocityCommand

NOWHERE: Pose2 = (0.0, 0.0, 0.0)


class Phase(Enum):
    """Kind of a half stride."""

    REST = "rest"
    SHIFT = "shift"  # from rest: the weight moves over one foot, both feet on the ground
    STEP = "step"
    SETTLE = "settle"  # to rest, both feet on the ground
    PAUSE = "pause"  # at rest: the robot may still rock from foot to foot


class StrideState(NamedTuple):
    """State of the walk at some tick; see `nao_lipm_gait.walks.base.WalkView`.

    Attributes:
        x: CoM in Q, forward [m].
        y: CoM in Q, to the left [m].
        sole_in_q: Pose of the supporting sole in Q.
        q_in_odom: Pose of Q by the planned steps.
        step_count: Number of support changes since the walk started.
    """

    support: int
    x: float
    y: float
    sole_in_q: Pose2
    q_in_odom: Pose2
    step_count: int
    phase: Phase


class HalfStride(NamedTuple):
    """One half stride, fixed when it begins; poses are in its Q.

    Attributes:
        ticks: Its duration in control periods, 2n of the paper.
        com_start: CoM at its beginning, x and y [m].
        step_size: Pose of the next Q.
    """

    phase: Phase
    support: int
    ticks: int
    com_start: tuple[float, float]
    step_size: Pose2
    standing: Pose2
    swing_start: Pose2
    swing_end: Pose2
    parameters: ZmpParameters


class ZmpWalk:
    """Omnidirectional walk on ZMP trajectories of constant cadence.

    Args:
        parameters: Parameters of the gait; `feedback_delay` is fixed from here on.
        control_period: Time between two ticks [s].
    """

    def __init__(self, parameters: ZmpParameters, control_period: float):
        self._dt = control_period
        self._half_stride: HalfStride
        self.hip_lag: float | None = None
        self.watches_hips = False
        self.delay_ticks = max(0, round(parameters.feedback_delay / control_period))
        self._p = parameters
        self.stand_at(NOWHERE)

    def set_parameters(self, parameters: ZmpParameters) -> None:
        """Use new parameters from the next half stride on; `delay_ticks` stays."""
        self._p = parameters

    def stand_at(self, q_in_odom: Pose2) -> None:
        """Reset to a stand: both feet side by side, the CoM at rest between them."""
        self._q_in_odom = q_in_odom
        self._step_count = 0
        self._stride = STEP_IN_PLACE
        self._last_step = NOWHERE
        self._stand(Phase.REST, LEFT, home_sole(LEFT, self._p), home_sole(RIGHT, self._p))
        self.predicted = self.expected = self._state()
        self._sent: deque[StrideState] = deque([self.predicted] * self.delay_ticks)

    # -- the three stages of a tick ----------------------------------------------------------------

    def start(self, command: VelocityCommand, inward: float = 0.0) -> None:
        """Shift the weight, so that the foot that leads the motion makes the first step."""
        support = first_support(command)
        self._stride = STEP_IN_PLACE
        self._step_count = 0
        half = self._half_stride
        soles = {half.support: half.standing, -half.support: half.swing_end}
        soles[LEFT], soles[RIGHT] = closer_soles(soles[LEFT], soles[RIGHT], inward)
        self._stand(Phase.SHIFT, support, soles[support], soles[-support])

    def catch(self, x: float, y: float, vx: float, vy: float) -> None:
        """Step in place, first with the unloaded foot, see `Walk`; there is no other reaction."""
        self.start(VelocityCommand(0.0, -y, 0.0))

    def expect(self) -> Expectation:
        """What was sent one delay ago is expected at the measurement."""
        before = self.expected
        self.expected = state = self._sent.popleft() if self._sent else self._state()
        if state.step_count != before.step_count:
            self._last_step = relative(state.q_in_odom, before.q_in_odom)
        return Expectation(state.support, (state.x, state.y), state.sole_in_q, self._last_step)

    def observe(
        self, measured_x: float, measured_y: float, acceleration: tuple[float, float] | None = None
    ) -> None:
        """Does nothing: this walk does not use the measured CoM."""

    def plan(self, command: VelocityCommand, *, sent: bool = True) -> BodyTargets:
        """Targets of this tick; at the end of a half stride the next one is planned."""
        self.predicted = self._state()
        self._sent.append(self.predicted)
        half, state = self._half_stride, self.predicted
        p = half.parameters
        com = (state.x, state.y, p.com_height)
        swing = self._swing_sole(half, p)
        self._targets = targets = body_targets(
            half.support, com, half.standing, swing, p, state.q_in_odom
        )
        self._tick += 1
        if self._tick >= self._half_stride.ticks:
            self._next_half_stride(command)
        return targets

    def lengthen(self, ahead: float) -> None:
        """See `Walk`: no step changes that has begun."""

    def replan(self) -> BodyTargets:
        """The targets of the last `plan`: nothing measured changes them."""
        return self._targets

    # -- planning ----------------------------------------------------------------------------------

    def _next_half_stride(self, command: VelocityCommand) -> None:
        done = self._half_stride
        if done.phase in (Phase.SHIFT, Phase.STEP):
            self._q_in_odom = compose(self._q_in_odom, done.step_size)
            self._step_count += 1
        self._half_stride, self._stride = self._successor(done, self._stride, command)
        self._tick = 0

    def _successor(
        self, done: HalfStride, stride: Stride, command: VelocityCommand
    ) -> tuple[HalfStride, Stride]:
        """The half stride after `done`, which was made with `stride`, and its stride."""
        if done.phase is Phase.SETTLE and self._pause_ticks > 0:
            return self._standing(Phase.PAUSE, done.support, done.standing, done.swing_end), stride
        if done.phase in (Phase.REST, Phase.SETTLE, Phase.PAUSE):
            return self._standing(Phase.REST, done.support, done.standing, done.swing_end), stride
        support = -done.support
        s = done.step_size
        standing, swing_start = relative(done.swing_end, s), relative(done.standing, s)
        if done.phase is Phase.STEP and command.is_zero and s == NOWHERE:
            return self._standing(Phase.SETTLE, support, standing, swing_start), stride
        # The CoM is half-way between the last Q and this one.
        x, y, _ = relative((0.5 * s[0], 0.5 * s[1], 0.0), s)
        double_step = 2.0 * self._ticks * self._dt
        asked = asked_stride(command, double_step, self._p)
        wanted = within_limits(asked, ellipsoid_share(asked, self._p))
        stride = approach(stride, wanted, self._p)
        step_size = stride.of_step(-support, self._p)
        landing = compose(step_size, home_sole(-support, self._p))
        following = HalfStride(
            Phase.STEP, support, self._ticks, (x, y), step_size, standing, swing_start, landing,
            self._p,
        )  # fmt: skip
        return following, stride

    def _stand(self, phase: Phase, support: int, standing: Pose2, other: Pose2) -> None:
        self._tick = 0
        self._half_stride = self._standing(phase, support, standing, other)

    def _standing(self, phase: Phase, support: int, standing: Pose2, other: Pose2) -> HalfStride:
        """A half stride with both feet on the ground."""
        ticks = self._standing_ticks
        if phase in (Phase.REST, Phase.PAUSE):
            ticks = 1 if phase is Phase.REST else self._pause_ticks
        return HalfStride(
            phase, support, ticks, (0.0, 0.0), NOWHERE, standing, other, other, self._p
        )

    @property
    def _standing_ticks(self) -> int:
        """Duration of the motion out of rest, and of the one back to it, in control periods."""
        return self._ticks

    @property
    def _pause_ticks(self) -> int:
        """Duration of the pause after a stop, in control periods."""
        return round(self._p.zmp_stop_pause / self._dt)

    @property
    def _ticks(self) -> int:
        """Duration of a half stride in control periods: 2n."""
        return max(2, round(self._p.zmp_step_duration / self._dt))

    # -- the half stride at a tick -----------------------------------------------------------------

    @property
    def _share(self) -> float:
        return self._tick / self._half_stride.ticks

    def _sway(self) -> float:
        """Offset of the CoM to the left of its line [m]."""
        half, p = self._half_stride, self._half_stride.parameters
        if half.phase in (Phase.REST, Phase.PAUSE):
            return 0.0
        w = natural_frequency(p.pendulum_height)
        duration = half.ticks * self._dt
        t = self._tick * self._dt
        if half.phase is Phase.STEP:
            return half.support * sway(t - 0.5 * duration, duration, p.zmp_offset_y, w)[0]
        speed = entry_speed(duration, p.zmp_offset_y, w)
        if half.phase is Phase.SHIFT:  # over this foot first, then towards the next one
            return -half.support * swing_in(t, duration, speed)
        return half.support * swing_out(t, duration, speed)

    def _com(self) -> tuple[float, float]:
        """CoM at this tick, x and y in Q [m]."""
        half, share = self._half_stride, self._share
        (x, y), s = half.com_start, half.step_size
        yaw = s[2] * (share - 0.5) if half.phase is Phase.STEP else 0.0
        out = self._sway()
        return (
            x + share * (0.5 * s[0] - x) - sin(yaw) * out,
            y + share * (0.5 * s[1] - y) + cos(yaw) * out,
        )

    def _state(self) -> StrideState:
        half = self._half_stride
        x, y = self._com()
        return StrideState(
            support=half.support,
            x=x,
            y=y,
            sole_in_q=half.standing,
            q_in_odom=self._q_in_odom,
            step_count=self._step_count,
            phase=half.phase,
        )

    def _swing_sole(self, half: HalfStride, p: ZmpParameters) -> SoleTarget:
        x, y, yaw = half.swing_start
        if half.phase is not Phase.STEP:
            return SoleTarget(x, y, 0.0, yaw)
        share, landing = self._share, half.swing_end
        gone = travel(share, p.zmp_double_support)
        height = lift(share, p.zmp_double_support)
        return SoleTarget(
            x + gone * (landing[0] - x),
            y + gone * (landing[1] - y),
            p.swing_lift * height,
            yaw + gone * (landing[2] - yaw),
            # Rolled outwards, so that its inner edge clears the floor; flat at both ends.
            roll=half.support * p.zmp_foot_roll * raised_cosine(2.0 * min(share, 1.0 - share)),
        )

    # -- state for status and diagnostics ----------------------------------------------------------

    @property
    def finished(self) -> bool:
        """Whether the walk is at rest, also at the time of the measurement."""
        return self.predicted.phase is Phase.REST and self.expected.phase is Phase.REST

    @property
    def stopping(self) -> bool:
        """Whether both feet stay on the ground from now on."""
        return self._half_stride.phase in (Phase.SETTLE, Phase.PAUSE, Phase.REST)

    @property
    def estimated(self) -> StrideState:
        """State at the time of the measurement; nothing corrects it."""
        return self.expected

    @property
    def origin_in_q(self) -> tuple[float, float]:
        """Desired ZMP, x and y in Q [m]."""
        half = self._half_stride
        if half.phase is not Phase.STEP:
            return 0.0, 0.0
        return self.predicted.x, half.support * half.parameters.zmp_offset_y

    @property
    def com_ahead(self) -> float:
        """0: the CoM is not measured."""
        return 0.0

    @property
    def step_size(self) -> Pose2:
        """Pose of the next Q in the current one."""
        return self._half_stride.step_size

    @property
    def reserve(self) -> float:
        """Share of the step limits that the current stride leaves unused."""
        return 1.0 - ellipsoid_share(self._stride, self._p)

    @property
    def time_left(self) -> float:
        """Time until the end of the half stride [s]; 0 at rest."""
        half = self._half_stride
        return 0.0 if half.phase is Phase.REST else (half.ticks - self._tick) * self._dt
