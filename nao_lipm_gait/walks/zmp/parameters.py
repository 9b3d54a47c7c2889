"""The parameters of the walks `zmp` and `preview` beside those of every walk."""

import attrs

from nao_lipm_gait.parameters import GaitParameters
from robot_core.schema import choice, number


@attrs.frozen
class ZmpParameters(GaitParameters):
    """Parameters of half strides of fixed duration, with trajectories of the ZMP."""

    walk: str = choice(("zmp", "preview"))

    zmp_step_duration: float = number(
        0.35, 0.1, 2.0, "s", "T/2: duration of one step (half a stride).",
        section="Walks `zmp` and `preview`",
    )
    zmp_offset_y: float = number(
        0.05, 0.0, 0.12, "m", "y_ZMP: lateral distance of the desired ZMP from Q."
    )
    zmp_double_support: float = number(
        0.268, 0.0, 0.9, "",
        "Share of a step with both feet on the ground, 1 - cos(c_3); the paper has c_3 = 0.75.",
    )
    zmp_foot_roll: float = number(
        0.0, -0.3, 0.3, "rad", "Outward roll of the swing foot at its highest point."
    )
    zmp_stop_pause: float = number(
        0.0, 0.0, 3.0, "s",
        "Pause at rest after a stop until the robot no longer rocks; a new walk or a motion begins "
        "after it.",
    )
