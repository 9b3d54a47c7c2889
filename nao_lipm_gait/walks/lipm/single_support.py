"""The plan of the running single support, recomputed in every tick from the corrected state.

Correcting the pendulum parameters, eqs (15)-(20), needs no code of its own here. All plans start
from the estimated position and velocity of the CoM, with t = 0 now. This is the pendulum through
that state: its orbital energy is (x_0)_y'^2 of (19), and t_i' of (20) is the time since its turning
point.

The lateral motion determines when the support changes, eqs (3)-(6), the sagittal motion where the
pendulum origin and the next foot are, eqs (7)-(9). Extensions answer a CoM that was pushed.
"""

from typing import final

from nao_lipm_gait.walks.lipm.extensions.recovery import (
    capture_shift,
    catching_stride,
    outward_origin_shift,
    turning_time,
)
from nao_lipm_gait.walks.lipm.extensions.turning import (
    STRAIGHT,
    TurnOfView,
    longer_step,
    turn_of_view,
)
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from nao_lipm_gait.walks.lipm.pendulum_origin import plan_pendulum_origin
from nao_lipm_gait.walks.lipm.state import WalkState
from nao_lipm_gait.walks.lipm.support_change import SupportChange, plan_support_change
from nao_lipm_gait.walks.pendulum import advance
from nao_lipm_gait.walks.steps import exchange_leads
from robot_core.types import Pose2

NEXT_TANH_MAX = 0.95
"""Cap on |tanh(k t_b-bar)|: with 1 or more the next pendulum would never turn back."""
ENTRY_MIN = 1e-3
"""Smallest distance of the CoM from the next origin at the support change [m]."""
STEP_DURATION_MAX = 0.45
"""[s] Longest single support."""
TIME_MIN = 1e-9
"""Times below this count as zero [s]."""
HOLD_TIME = 0.06
"""[s] Last time of a step in which r_x is held and the step size follows instead."""
CATCH_IN_SHARE = 0.5
"""How far feedback may move the next foot inwards, as a share of outwards."""
SEARCH_STEP = 0.01
"""Time step of the search for an earlier support change [s]."""


@final
class StepRequest:
    """Commanded step and the constraints that are already fixed.

    Attributes:
        step_size: Wanted s-bar by the command [m, m, rad].
        passing: v_0 / k of the wanted walk [m]; see `steady_walk.passing_speed`.
        elapsed: Time since the last support change [s].
        last_s_x: s_x of the last step [m]; the swing foot travels both steps.
        r_x: Pendulum origin of the last tick [m].
        shifts_weight: Whether the CoM falls out of the stand; no foot swings yet.
    """

    __slots__ = ("elapsed", "last_s_x", "passing", "r_x", "shifts_weight", "step_size")

    def __init__(
        self,
        step_size: Pose2,
        passing: float,
        elapsed: float,
        last_s_x: float,
        r_x: float,
        shifts_weight: bool,
    ):
        self.step_size = step_size
        self.passing = passing
        self.elapsed = elapsed
        self.last_s_x = last_s_x
        self.r_x = r_x
        self.shifts_weight = shifts_weight


@final
class StepPlan:
    """The rest of the running step.

    Attributes:
        time: Time until the support change, t_e from now [s].
        origin: Pendulum origin r, x and y in Q [m].
        step_size: Step size s-bar, the pose of Q-bar in Q.
    """

    __slots__ = ("origin", "step_size", "time")

    def __init__(self, time: float, origin: tuple[float, float], step_size: Pose2):
        self.time = time
        self.origin = origin
        self.step_size = step_size


@final
class LateralPlan:
    """The support change, and the pendulum origins in y; mirrored.

    Attributes:
        r_y: Pendulum origin [m], positive outwards.
        stride: Distance D to the next origin [m].
    """

    __slots__ = ("change", "r_y", "stride", "view")

    def __init__(
        self, change: SupportChange, r_y: float, stride: float, view: TurnOfView = STRAIGHT
    ):
        self.change = change
        self.r_y = r_y
        self.stride = stride
        self.view = view


@final
class SagittalPlan:
    """Pendulum origin and step size in x.

    Attributes:
        r_x: Pendulum origin in Q [m].
        s_x: Step size s-bar_x [m].
        excess: By how much the required step exceeds the wanted one, before limits [m].
    """

    __slots__ = ("excess", "r_x", "s_x")

    def __init__(self, r_x: float, s_x: float, excess: float):
        self.r_x = r_x
        self.s_x = s_x
        self.excess = excess


class SingleSupport:
    """Plans single supports with one set of parameters.

    Args:
        parameters: Parameters of the gait.
        k: Natural frequency of the pendulum [1/s].
    """

    def __init__(self, parameters: LipmParameters, k: float):
        self._p = parameters
        self._k = k
        self._straight_lead, _ = exchange_leads(0.0, parameters)

    def plan(self, state: WalkState, request: StepRequest) -> StepPlan:
        """The rest of the step from the corrected state on."""
        lateral = self._plan_lateral(state, request)  # (3)-(6)
        sagittal = self._plan_sagittal(state, request, lateral)  # (7)-(9)
        if self._is_too_long(request, sagittal):
            lateral, sagittal = self._shortened(state, request, lateral, sagittal)
        step_size = sagittal.s_x, self._s_y(state, lateral), request.step_size[2]
        origin = sagittal.r_x, state.support * lateral.r_y
        return StepPlan(lateral.change.time, origin, step_size)

    def _plan_lateral(self, state: WalkState, request: StepRequest) -> LateralPlan:
        """When the support changes, r_y and D: (3)-(6)."""
        p, k = self._p, self._k
        swing, yaw = -state.support, request.step_size[2]
        width, r_y = p.pendulum_width, p.pendulum_offset_y
        stride = 2.0 * r_y + swing * request.step_size[1]
        earliest = 0.0 if request.shifts_weight else p.step_duration_min - request.elapsed
        earliest = max(earliest, TIME_MIN)
        latest = max(earliest, STEP_DURATION_MAX - request.elapsed)
        x, v = swing * state.y + r_y, swing * state.vy
        view = STRAIGHT
        lead = self._straight_lead if yaw != 0.0 and request.passing != 0.0 else 0.0
        if lead > 0.0:
            vx = request.passing * k * r_y / width
            view = turn_of_view(swing, yaw, -request.passing * lead, vx)
            # In a steady curve both pendulums last equally long only if the outer one is wider.
            width += 0.5 * view.faster / (k * lead)
        change = plan_support_change(x, v, k, stride, width, earliest, latest, view)
        if change.feasible or request.shifts_weight or not p.feedback:
            return LateralPlan(change, r_y, stride, view)
        # Extension: no support change in time suits this CoM.
        shift = outward_origin_shift(x, v, k, stride, width, latest, p.pendulum_shift_side_max)
        stride += shift
        if shift > 0.0:
            change = plan_support_change(x + shift, v, k, stride, width, earliest, latest)
        return LateralPlan(change, r_y + shift, self._catching(change, stride))

    def _plan_sagittal(
        self, state: WalkState, request: StepRequest, lateral: LateralPlan
    ) -> SagittalPlan:
        """Both r_x and s-bar_x for the support change of `lateral`: (7)-(9)."""
        p, k, change = self._p, self._k, lateral.change
        swing, wanted, yaw = -state.support, request.step_size[0], request.step_size[2]
        entry = max(lateral.stride - lateral.view.nearer - change.position, ENTRY_MIN)
        entry_velocity = change.velocity + lateral.view.faster
        # tanh(k t_b-bar) is velocity / (k distance) of the next pendulum at its beginning.
        next_tanh = -min(max(entry_velocity / (k * entry), 0.0), NEXT_TANH_MAX)
        y, vy = swing * (change.position - lateral.r_y), swing * change.velocity
        longer = longer_step(yaw, next_tanh, k, y - self._s_y(state, lateral), vy)
        held = p.extensions and change.time < HOLD_TIME and not request.shifts_weight
        plan = plan_pendulum_origin(
            state.x,
            state.vx,
            k,
            change.time,
            next_tanh,
            wanted + longer,
            -p.pendulum_shift_back_max,
            p.pendulum_shift_max,
            request.r_x if held else None,
        )
        if not plan.limited:
            return SagittalPlan(plan.r_x, plan.s_x - longer, 0.0)
        s_x = plan.s_x
        if p.feedback and (p.step_capture > 0.0 or p.step_capture_back > 0.0):
            shift = capture_shift(
                state.x, state.vx, k, change.time, next_tanh, plan.r_x, s_x, request.passing
            )
            s_x += (p.step_capture if shift > 0.0 else p.step_capture_back) * shift
        excess = s_x - (wanted + longer)
        # What feedback needs is bounded by the legs, not by the sizes of commanded steps.
        travel, last = p.step_travel_max, request.last_s_x
        s_min = longer + max(min(-0.5 * travel, wanted), -travel - last)
        s_max = longer + min(max(0.5 * travel, wanted), travel - last)
        return SagittalPlan(plan.r_x, min(max(s_x, s_min), s_max) - longer, excess)

    def _s_y(self, state: WalkState, lateral: LateralPlan) -> float:
        """s-bar_y [m] that leads from r_y to the next origin."""
        return -state.support * (lateral.stride - lateral.r_y - self._p.pendulum_offset_y)

    # -- extensions --------------------------------------------------------------------------------

    def _is_too_long(self, request: StepRequest, plan: SagittalPlan) -> bool:
        corrects = self._p.feedback and not request.shifts_weight
        return corrects and abs(plan.excess) > self._p.step_hurry

    def _shortened(
        self, state: WalkState, request: StepRequest, lateral: LateralPlan, sagittal: SagittalPlan
    ) -> tuple[LateralPlan, SagittalPlan]:
        """The step with a shorter duration, until the CoM asks for one that is not too long.

        The divergent component grows by e^(k t), so a CoM pushed along x needs the next foot soon.
        That foot is also nearer to the support foot, because the CoM has moved less in y.
        """
        p, k = self._p, self._k
        swing = -state.support
        x, v = swing * state.y + lateral.r_y, swing * state.vy
        earliest = max(p.step_duration_min - request.elapsed, turning_time(x, v, k))
        usual_stride = 2.0 * p.pendulum_offset_y + swing * request.step_size[1]
        stride = usual_stride + lateral.r_y - p.pendulum_offset_y
        time = lateral.change.time - SEARCH_STEP
        while time >= earliest and self._is_too_long(request, sagittal):
            position, velocity = advance(x, v, k, time)
            change = SupportChange(time, position, velocity, False)
            lateral = LateralPlan(change, lateral.r_y, self._catching(change, stride))
            sagittal = self._plan_sagittal(state, request, lateral)
            time -= SEARCH_STEP
        return lateral, sagittal

    def _catching(self, change: SupportChange, stride: float) -> float:
        """D [m], moved towards where the next pendulum gets its wanted width."""
        p = self._p
        caught = catching_stride(change.position, change.velocity, self._k, p.pendulum_width)
        outwards, inwards = p.step_catch, CATCH_IN_SHARE * p.step_catch
        return stride + min(max(caught - stride, -inwards), outwards)
