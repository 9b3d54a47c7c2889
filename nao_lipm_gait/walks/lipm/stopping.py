"""The last phase of a walk: both feet down, the CoM brought to rest between them.

With both feet on the ground the pendulum origin may lie anywhere between them. Placed beyond the
divergent component xi as seen from the goal, r = xi + (c/k) xi, it makes xi, and with it the CoM,
decay towards the middle of Q at the rate c.
"""

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.lipm.walk_state import WalkState
from nao_lipm_gait.walks.pendulum import divergent_component

DECAY_RATE = 6.0
"""c [1/s]"""
SOLE_REACH = 0.04
"""[m] how far ahead and behind the foot reference the origin may go."""
REST_POSITION = 0.002
"""[m]"""
REST_VELOCITY = 0.01
"""[m/s]"""


def come_to_rest(state: WalkState, k: float, parameters: GaitParameters) -> tuple[float, float]:
    """The pendulum origin in Q [m] that brings the CoM to the middle of Q."""
    gain = 1.0 + DECAY_RATE / k
    side = 0.5 * parameters.foot_spacing
    x = gain * divergent_component(state.x, state.vx, k)
    y = gain * divergent_component(state.y, state.vy, k)
    return min(max(x, -SOLE_REACH), SOLE_REACH), min(max(y, -side), side)


def can_come_to_rest(state: WalkState, k: float) -> bool:
    """False where the CoM moves too fast in x for an origin under the soles to catch it."""
    return abs(divergent_component(state.x, state.vx, k)) < SOLE_REACH / (1.0 + DECAY_RATE / k)


def is_at_rest(state: WalkState) -> bool:
    return (
        abs(state.x) < REST_POSITION
        and abs(state.y) < REST_POSITION
        and abs(state.vx) < REST_VELOCITY
        and abs(state.vy) < REST_VELOCITY
    )
