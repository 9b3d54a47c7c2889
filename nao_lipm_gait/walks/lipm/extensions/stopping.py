"""Extension of the paper: the end of a walk, with both feet down and the CoM brought to rest.

With both feet on the ground the pendulum origin may be anywhere between them. At r = xi + (c / k)
xi, beyond the divergent component xi of the CoM in Q, it makes xi decay at the rate c, and with it
the CoM moves to the middle of Q.
"""

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.lipm.state import WalkState
from nao_lipm_gait.walks.pendulum import divergent_component

DECAY_RATE = 6.0
"""c [1/s]."""
SOLE_REACH = 0.04
"""How far ahead of and behind the foot reference the origin may be [m]."""
REST_POSITION = 0.002
"""Largest distance of a CoM at rest from the middle of Q [m]."""
REST_VELOCITY = 0.01
"""Largest velocity of a CoM at rest [m/s]."""


def stopping_origin(state: WalkState, k: float, parameters: GaitParameters) -> tuple[float, float]:
    """The pendulum origin in Q [m] that brings the CoM to the middle of Q."""
    gain = 1.0 + DECAY_RATE / k
    side = 0.5 * parameters.foot_spacing
    x = gain * divergent_component(state.x, state.vx, k)
    y = gain * divergent_component(state.y, state.vy, k)
    return min(max(x, -SOLE_REACH), SOLE_REACH), min(max(y, -side), side)


def can_stop(state: WalkState, k: float) -> bool:
    """Whether an origin below the soles can stop the motion of the CoM in x."""
    return abs(divergent_component(state.x, state.vx, k)) < SOLE_REACH / (1.0 + DECAY_RATE / k)


def is_at_rest(state: WalkState) -> bool:
    """Whether the CoM is at rest in the middle of Q."""
    return (
        abs(state.x) < REST_POSITION
        and abs(state.y) < REST_POSITION
        and abs(state.vx) < REST_VELOCITY
        and abs(state.vy) < REST_VELOCITY
    )
