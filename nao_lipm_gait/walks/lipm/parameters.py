"""The parameters of the walk `lipm` beside those of every walk."""

from collections.abc import Mapping
from typing import Any

import attrs

from nao_lipm_gait.parameters import GaitParameters
from robot_core.schema import choice, number, switch

EXTENSIONS_OFF: Mapping[str, float | bool] = {
    "pendulum_shift_side_max": 0.0,
    "swing_toe_lift": 0.0,
    "step_capture": 0.0,
    "step_capture_back": 0.0,
    "step_catch": 0.0,
    "step_hurry": 1.0,
    "offset_time": 0.0,
    "push_velocity": 0.0,
    "sway_limit": 0.0,
    "heading_gain": 0.0,
    "yaw_from_lean": False,
    "speed_time": 0.0,
    "level_soles": False,
    "follow_ground": False,
    "gyro_pitch_gain": 0.0,
    "gyro_roll_gain": 0.0,
    "tilt_pitch_gain": 0.0,
    "arm_swing": 0.0,
    "stand_catch": 0.0,
}
"""The extensions that are on by default, and the values with which they do nothing."""


@attrs.frozen(init=False)
class LipmParameters(GaitParameters):
    """Parameters of the observed pendulum of the first paper."""

    walk: str = choice(("lipm",))
    extensions: bool = switch(
        True,
        "Extensions of the paper; false turns each of them off whose parameters are not named.",
        section="Walk `lipm`: extensions",
    )

    pendulum_shift_max: float = number(
        0.045, 0.0, 0.08, "m",
        "Largest shift r_x of the pendulum origin towards the toes; beyond it the step size "
        "changes.",
        section="Walk `lipm`: the step",
    )
    pendulum_shift_back_max: float = number(
        0.036, 0.0, 0.08, "m", "Largest shift r_x of the pendulum origin towards the heel."
    )
    pendulum_shift_side_max: float = number(
        0.055, 0.0, 0.06, "m",
        "Largest outward shift of the pendulum origin inside the sole if the CoM returns too late.",
    )
    step_duration_min: float = number(
        0.12, 0.05, 0.5, "s", "Shortest time between two support changes."
    )
    swing_rise: float = number(
        0.46, 0.1, 0.5, "",
        "Share of the step for lifting the foot, and again for lowering it; the foot stays up in "
        "between.",
    )
    swing_travel_end: float = number(
        0.97, 0.5, 1.0, "", "Share of the step after which the foot no longer moves in x and y."
    )
    swing_toe_lift: float = number(
        0.5, 0.0, 2.0, "rad/m",
        "Toe lift in mid-swing per metre that the foot moves forward; compensates for joint lag.",
    )
    step_travel_max: float = number(
        0.21, 0.05, 0.4, "m",
        "Longest path of a swing foot in x, that is the sum of two successive steps; the step that "
        "feedback needs is at most half as long.",
    )
    step_capture: float = number(
        0.5, 0.0, 1.0, "",
        "Step size while r_x is at its limit: 0 = the step that keeps the CoM velocity, 1 = the "
        "step that corrects it.",
    )
    step_capture_back: float = number(
        0.15, 0.0, 1.0, "", "As step_capture, for a step that must reach further back."
    )
    step_catch: float = number(
        0.06, 0.0, 0.1, "m",
        "Distance by which feedback may move the next foot outwards, and half as far inwards.",
    )
    step_hurry: float = number(
        0.09, 0.0, 1.0, "m",
        "Shorten the step's duration if the CoM needs a step this much longer than commanded; 1 = "
        "never.",
    )

    position_sigma: float = number(
        0.0001, 0.0, 0.1, "m", "Standard deviation of the CoM position's process noise per tick.",
        section="Walk `lipm`: CoM observer",
    )
    velocity_sigma: float = number(
        0.004, 0.0, 1.0, "m/s", "Standard deviation of the CoM velocity's process noise per tick."
    )
    offset_time: float = number(
        3.0, 0.0, 60.0, "s",
        "Time constant for learning constant errors of the measured CoM; 0 = off.",
    )
    lean_torque: float = number(
        0.0, 0.0, 1.0, "",
        "Share of that error forward for which motors that give way get torque, as for a lean.",
    )
    push_velocity: float = number(
        0.14, 0.0, 1.0, "m/s",
        "Detect a push if CoM and accelerometer show that the CoM moves this much faster than "
        "expected; 0 = off.",
    )
    sway_limit: float = number(
        0.0022, 0.0, 0.05, "m",
        "Strides become shorter if the measured CoM sways more than this (standard deviation to "
        "the side, beyond what is expected); 0 = off.",
    )
    hip_lag_max: float = number(
        0.0, 0.0, 0.05, "s",
        "For motors that are weak or hot: steps ahead begin short and stay below 63 mm (of a NAO) "
        "until the hip of the swing leg lags at most this much more than its knee; 0 = off.",
    )

    @property
    def stance_time(self) -> float:
        """[s] As for every walk; without extensions the sole counts more (open in the paper)."""
        return super().stance_time if self.extensions else 1.0

    def __init__(self, **values: Any) -> None:
        off = EXTENSIONS_OFF if values.get("extensions") is False else {}
        self.__attrs_init__(**{**off, **values})

    def _kept(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        kept = super()._kept(changes)
        if changes.get("extensions", self.extensions) == self.extensions:
            return kept
        return {name: value for name, value in kept.items() if name not in EXTENSIONS_OFF}
