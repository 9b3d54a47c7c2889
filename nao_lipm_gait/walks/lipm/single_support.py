"""The plan of the running single support phase, made anew in every tick from the corrected state.

The lateral motion says when the support changes (4)-(6), the sagittal motion where the pendulum
stands until then and where the next foot goes (7)-(9). Both have answers of their own to a CoM that
was pushed, and `_hurried` ends a step sooner.
"""

from math import tan
from typing import NamedTuple

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import Pose2
from nao_lipm_gait.walks.lipm.step_planning import SagittalPlan, plan_sagittal
from nao_lipm_gait.walks.lipm.support_change import (
    STRAIGHT,
    SupportChange,
    TurnOfView,
    origin_shift_for,
    plan_support_change,
    stride_that_catches,
    turn_of_view,
    turning_time,
)
from nao_lipm_gait.walks.lipm.walk_state import WalkState
from nao_lipm_gait.walks.pendulum import advance
from nao_lipm_gait.walks.steps import exchange_leads

MAX_PHASE_TANH = 0.95
"""The next pendulum must turn back: its CoM may not enter faster than this share of k x."""
ORIGIN_HOLD_TIME = 0.06
"""[s] So close to the support change r_x has no lever left (eq 9 turns singular): s_x follows."""
SHORTEST_PIECE = 1e-9
"""[s]"""
SEARCH_STEP = 0.01
"""[s] in which a sooner end of a step is looked for."""


class Phase(NamedTuple):
    """What is asked of the running phase, and what is already fixed."""

    wanted: Pose2
    """s-bar [m, m, rad] by the command."""
    passing: float
    """v0/k [m] of the wanted walk, see `step_size.passing_speed`."""
    elapsed: float
    """[s] since the support changed."""
    last_step: float
    """s_x [m] of the step before: the swing foot travels both."""
    origin: float
    """r_x [m] as it is."""
    shifting_weight: bool
    """The first fall out of a stand: no foot swings yet."""


class PhasePlan(NamedTuple):
    """The rest of the running phase."""

    time: float
    """[s] until the support changes."""
    origin: tuple[float, float]
    """r [m] in Q."""
    step_size: Pose2
    """s-bar."""


class LateralPlan(NamedTuple):
    """The end of the running phase, and where the pendulums stand in y."""

    change: SupportChange
    offset_y: float
    """r_y [m], outwards."""
    stride: float
    """D [m] to the next origin."""
    view: TurnOfView = STRAIGHT


class SingleSupport:
    """Plans phases with one set of parameters."""

    def __init__(self, parameters: GaitParameters, k: float):
        """K [1/s] of the pendulum."""
        self._p = parameters
        self._k = k

    def plan(self, state: WalkState, phase: Phase) -> PhasePlan:
        """The pendulum re-determined from the corrected state: (15)-(20), then (4)-(6), (7)-(9)."""
        lateral = self._lateral(state, phase)
        sagittal = self._sagittal(state, phase, lateral)
        if self._is_urgent(phase, sagittal):
            lateral, sagittal = self._hurried(state, phase, lateral, sagittal)
        step_size = sagittal.step_size, self._side(state, lateral), phase.wanted[2]
        origin = sagittal.origin, state.support * lateral.offset_y
        return PhasePlan(lateral.change.time, origin, step_size)

    def _lateral(self, state: WalkState, phase: Phase) -> LateralPlan:
        """When the support changes, r_y and D; (4)-(6).

        A pushed CoM that no support change in time suits moves r_y outwards and the next foot.
        """
        p, k = self._p, self._k
        swing, yaw = -state.support, phase.wanted[2]
        width, offset_y = p.pendulum_width, p.pendulum_offset_y
        stride = 2.0 * offset_y + swing * phase.wanted[1]
        earliest = 0.0 if phase.shifting_weight else p.step_duration_min - phase.elapsed
        earliest = max(earliest, SHORTEST_PIECE)
        latest = max(earliest, p.step_duration_max - phase.elapsed)
        x, v = swing * state.y + offset_y, swing * state.vy
        view = STRAIGHT
        lead = exchange_leads(0.0, p)[0] if yaw != 0.0 and phase.passing != 0.0 else 0.0
        if lead > 0.0:
            vx = phase.passing * k * offset_y / width
            view = turn_of_view(swing, tan(yaw), -phase.passing * lead, vx)
            # In a steady curve both pendulums last equally long only if the outer one is wider.
            width += 0.5 * view.faster / (k * lead)
        change = plan_support_change(x, v, k, stride, width, earliest, latest, view)
        if change.feasible or phase.shifting_weight or not p.feedback:
            return LateralPlan(change, offset_y, stride, view)
        shift = origin_shift_for(x, v, k, stride, width, latest, p.pendulum_shift_side_max)
        stride += shift
        if shift > 0.0:
            change = plan_support_change(x + shift, v, k, stride, width, earliest, latest)
        return LateralPlan(change, offset_y + shift, self._caught(change, stride))

    def _sagittal(self, state: WalkState, phase: Phase, lateral: LateralPlan) -> SagittalPlan:
        """r_x and s-bar_x for the support change of `lateral`; (7)-(9).

        In a turn by theta, Q-bar sees some of the motion in y as motion in x. With T of
        `plan_sagittal`, its condition x-bar_0 = 0 becomes that of a straight step which is longer
        by tan(theta) (T v_y - (y - s-bar_y)) at the exchange.
        """
        p, k, change = self._p, self._k, lateral.change
        swing, wanted, yaw = -state.support, phase.wanted[0], phase.wanted[2]
        entry = max(lateral.stride - lateral.view.nearer - change.position, 1e-3)
        entry_velocity = change.velocity + lateral.view.faster
        phase_tanh = min(max(entry_velocity / (k * entry), 0.0), MAX_PHASE_TANH)
        y, vy = swing * (change.position - lateral.offset_y), swing * change.velocity
        longer = tan(yaw) * (-phase_tanh / k * vy - (y - self._side(state, lateral)))
        stretch = p.step_stretch_max if p.feedback else 0.0
        travel, last = p.step_travel_max, phase.last_step
        is_held = change.time < ORIGIN_HOLD_TIME and not phase.shifting_weight
        plan = plan_sagittal(
            state.x,
            state.vx,
            k,
            change.time,
            -phase_tanh,
            wanted + longer,
            -p.pendulum_shift_back_max,
            p.pendulum_shift_max,
            longer + max(min(-p.step_backward_max, wanted) - stretch, -travel - last),
            longer + min(max(p.step_forward_max, wanted) + stretch, travel - last),
            held_origin=phase.origin if is_held else None,
            capture=p.step_capture if p.feedback else 0.0,
            capture_back=p.step_capture_back if p.feedback else 0.0,
            passing=phase.passing,
        )
        return SagittalPlan(plan.origin, plan.step_size - longer, plan.correction)

    def _hurried(
        self, state: WalkState, phase: Phase, lateral: LateralPlan, sagittal: SagittalPlan
    ) -> tuple[LateralPlan, SagittalPlan]:
        """The step ended sooner, until the CoM asks for one that is not much longer than wanted.

        The divergent component grows by e^(k t): a CoM pushed along x needs the next foot soon.
        The next foot then stands nearer, because the CoM has not come as far in y.
        """
        p, k = self._p, self._k
        swing = -state.support
        x, v = swing * state.y + lateral.offset_y, swing * state.vy
        earliest = max(p.step_duration_min - phase.elapsed, turning_time(x, v, k))
        usual_stride = 2.0 * p.pendulum_offset_y + swing * phase.wanted[1]
        stride = usual_stride + lateral.offset_y - p.pendulum_offset_y
        time = lateral.change.time - SEARCH_STEP
        while time >= earliest and self._is_urgent(phase, sagittal):
            change = SupportChange(time, *advance(x, v, k, time), feasible=False)
            lateral = LateralPlan(change, lateral.offset_y, self._caught(change, stride))
            sagittal = self._sagittal(state, phase, lateral)
            time -= SEARCH_STEP
        return lateral, sagittal

    def _is_urgent(self, phase: Phase, plan: SagittalPlan) -> bool:
        corrects = self._p.feedback and not phase.shifting_weight
        return corrects and abs(plan.correction) > self._p.step_hurry

    def _caught(self, change: SupportChange, stride: float) -> float:
        """D [m] moved towards where the next pendulum gets its width."""
        p = self._p
        caught = stride_that_catches(change.position, change.velocity, self._k, p.pendulum_width)
        return stride + min(max(caught - stride, -p.step_catch_in), p.step_catch_out)

    def _side(self, state: WalkState, lateral: LateralPlan) -> float:
        """s-bar_y [m] that leads from r_y to the next origin."""
        return -state.support * (lateral.stride - lateral.offset_y - self._p.pendulum_offset_y)
