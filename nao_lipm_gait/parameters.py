"""The parameter table of the gait: the one place where a parameter is born.

The YAML presets, the ROS parameter descriptors, the table in the documentation and the tests are
all made from `PARAMETERS`.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from nao_lipm_gait.errors import NaoGaitError, is_number
from nao_lipm_gait.resources import find


def _parameter(
    default: float | bool, minimum: float, maximum: float, unit: str, group: str, meaning: str
) -> Any:
    return dataclasses.field(
        default=default,
        metadata={
            "minimum": minimum,
            "maximum": maximum,
            "unit": unit,
            "group": group,
            "meaning": meaning,
        },
    )


def _switch(default: bool, group: str, meaning: str) -> Any:
    return _parameter(default, 0, 1, "", group, meaning)


def _choice(choices: tuple[str, ...], group: str, meaning: str) -> Any:
    """One of some words; the first is the default."""
    return dataclasses.field(
        default=choices[0],
        metadata={
            "minimum": 0,
            "maximum": 0,
            "unit": "",
            "group": group,
            "meaning": meaning,
            "choices": choices,
        },
    )


@dataclass(frozen=True, slots=True)
class GaitParameters:
    """Everything that can be tuned; SI units. Each field carries its unit, range and meaning."""

    # -- walk --------------------------------------------------------------------------------------
    walk: str = _choice(
        ("lipm", "zmp", "preview"), "walk",
        "which walk: lipm = the first paper's observed pendulum, zmp = the second's trajectories, "
        "preview = ZMP preview control",
    )
    # -- pendulum ----------------------------------------------------------------------------------
    pendulum_height: float = _parameter(
        0.24, 0.1, 0.6, "m", "pendulum", "assumed height h of the pendulum; sets k = sqrt(g/h)"
    )
    pendulum_width: float = _parameter(
        0.04, 0.005, 0.1, "m", "pendulum",
        "(x0)_y: distance of the CoM from the pendulum origin where it turns back; wider = faster",
    )
    pendulum_offset_y: float = _parameter(
        0.05, 0.02, 0.12, "m", "pendulum", "r_y: distance of the pendulum origin from Q"
    )
    pendulum_shift_max: float = _parameter(
        0.045, 0.0, 0.08, "m", "pendulum",
        "cap on r_x towards the toes; a step that needs more is made longer or shorter",
    )
    pendulum_shift_back_max: float = _parameter(
        0.036, 0.0, 0.08, "m", "pendulum", "the same cap towards the heel"
    )
    pendulum_shift_side_max: float = _parameter(
        0.055, 0.0, 0.06, "m", "pendulum",
        "how far r_y may move outwards inside the sole for a CoM that comes back too late",
    )
    step_duration_min: float = _parameter(
        0.12, 0.05, 0.5, "s", "pendulum", "no support change earlier than this after the last one"
    )
    step_duration_max: float = _parameter(
        0.45, 0.1, 2.0, "s", "pendulum", "no single support longer than this"
    )
    # -- ZMP walk ----------------------------------------------------------------------------------
    zmp_step_duration: float = _parameter(
        0.35, 0.1, 2.0, "s", "zmp", "T/2: duration of a half stride, that is of one step"
    )
    zmp_offset_y: float = _parameter(
        0.05, 0.0, 0.12, "m", "zmp", "y_ZMP: distance of the desired ZMP from Q"
    )
    zmp_double_support: float = _parameter(
        0.268, 0.0, 0.9, "", "zmp",
        "share of a step with both feet on the ground: 1 - cos(c_3), with the paper's c_3 = 0.75",
    )
    zmp_foot_roll: float = _parameter(
        0.0, -0.3, 0.3, "rad", "zmp", "how far the swing foot is rolled outwards at its highest"
    )
    # -- preview control ---------------------------------------------------------------------------
    preview_time: float = _parameter(
        0.8, 0.1, 3.0, "s", "preview", "how far ahead the wanted ZMP is looked at"
    )
    preview_jerk: float = _parameter(
        10000.0, 10.0, 1000000.0, "1/s^3", "preview",
        "jerk per metre of ZMP error that costs the same; more = nearer to the ZMP, less smooth",
    )
    # -- stance ------------------------------------------------------------------------------------
    com_height: float = _parameter(
        0.24, 0.15, 0.4, "m", "stance", "height of the whole-body CoM above the soles"
    )
    foot_spacing: float = _parameter(
        0.12, 0.08, 0.2, "m", "stance", "lateral distance between the ankles"
    )
    foot_reference_x: float = _parameter(
        0.0205, -0.03, 0.06, "m", "stance",
        "optimal pendulum origin ahead of the ankle (where r_x = 0)",
    )
    torso_pitch: float = _parameter(
        0.04, -0.3, 0.3, "rad", "stance", "forward lean of the torso while walking"
    )
    # -- swing foot --------------------------------------------------------------------------------
    swing_lift: float = _parameter(
        0.0275, 0.0, 0.06, "m", "swing", "height of the swing foot at its highest"
    )
    swing_rise: float = _parameter(
        0.46, 0.1, 0.5, "", "swing",
        "share of the step for lifting, and again for lowering; in between the foot stays up",
    )
    swing_travel_end: float = _parameter(
        0.97, 0.5, 1.0, "", "swing",
        "share of the step after which the foot no longer moves in x, y",
    )
    swing_toe_lift: float = _parameter(
        0.5, 0.0, 2.0, "rad/m", "swing",
        "toes up in mid-swing, per metre of the foot's way forward: joints that lag let them hang",
    )
    # -- step sizes --------------------------------------------------------------------------------
    step_forward_max: float = _parameter(
        0.105, 0.0, 0.2, "m", "step", "largest step size forward"
    )
    step_backward_max: float = _parameter(
        0.085, 0.0, 0.2, "m", "step", "largest step size backward"
    )
    step_side_max: float = _parameter(
        0.14, 0.0, 0.2, "m", "step", "largest sum of the side steps of both feet (one double step)"
    )
    step_turn_max: float = _parameter(
        1.0, 0.0, 1.5, "rad", "step", "largest turn of both feet together (one double step)"
    )
    step_limit_norm: float = _parameter(
        1.0, 1.0, 4.0, "", "step",
        "how limits add up where directions mix: 2 = an ellipsoid, 1 = the shares' plain sum",
    )
    step_side_share: float = _parameter(
        0.8, 0.5, 1.0, "", "step",
        "share of a side step that the leading foot takes; the trailing foot takes the rest",
    )
    step_turn_share: float = _parameter(
        0.5, 0.5, 1.0, "", "step",
        "share of a turn that the opening foot takes; the closing foot takes the rest",
    )
    step_forward_rate: float = _parameter(
        0.02, 0.001, 0.2, "m", "step", "largest change of the forward step size from step to step"
    )
    step_side_rate: float = _parameter(
        0.03, 0.001, 0.2, "m", "step", "largest change of the side step size from step to step"
    )
    step_turn_rate: float = _parameter(
        0.2, 0.01, 1.5, "rad", "step", "largest change of the turn from step to step"
    )
    step_stretch_max: float = _parameter(
        0.065, 0.0, 0.2, "m", "step", "how far feedback may lengthen a step beyond its limits in x"
    )
    step_travel_max: float = _parameter(
        0.21, 0.05, 0.4, "m", "step", "longest way of a swing foot in x: this step and the last one"
    )
    step_capture: float = _parameter(
        0.5, 0.0, 1.0, "", "step",
        "where r_x is at its cap: 0 = the step that keeps the speed, 1 = the one that corrects it",
    )
    step_capture_back: float = _parameter(
        0.15, 0.0, 1.0, "", "step", "the same for a step that has to reach further back"
    )
    step_catch_out: float = _parameter(
        0.06, 0.0, 0.15, "m", "step", "how far feedback may put the next foot further out"
    )
    step_catch_in: float = _parameter(
        0.03, 0.0, 0.05, "m", "step", "how far feedback may put the next foot further in"
    )
    step_hurry: float = _parameter(
        0.09, 0.0, 1.0, "m", "step",
        "feedback ends a step sooner that the CoM asks to be this much longer; 1 = never",
    )
    # -- observer ----------------------------------------------------------------------------------
    feedback: bool = _switch(
        True, "observer",
        "correct the pendulum by the observed CoM and the posture by the gyro; false = open loop",
    )
    feedback_delay: float = _parameter(
        0.06, 0.0, 0.2, "s", "observer", "sensor delay plus motor lag that the prediction bridges"
    )
    position_sigma: float = _parameter(
        0.0001, 0.0, 0.1, "m", "observer", "process noise of the CoM position per tick"
    )
    velocity_sigma: float = _parameter(
        0.004, 0.0, 1.0, "m/s", "observer", "process noise of the CoM velocity per tick"
    )
    measurement_sigma: float = _parameter(
        0.02, 0.0001, 1.0, "m", "observer", "deviation of the measured CoM; smaller trusts it more"
    )
    offset_time: float = _parameter(
        3.0, 0.0, 60.0, "s", "observer",
        "time over which constant errors of the measured CoM are learned; 0 = not at all",
    )
    push_velocity: float = _parameter(
        0.14, 0.0, 1.0, "m/s", "observer",
        "a measured CoM that moves this much faster than expected was pushed; 0 = never",
    )
    push_acceleration: bool = _switch(
        True, "observer", "pushes are also felt by the accelerometer, sooner than the CoM moves"
    )
    # -- heading -----------------------------------------------------------------------------------
    heading_gain: float = _parameter(
        1.5, 0.0, 5.0, "1/s", "heading",
        "turning rate per heading error while no turn is commanded; 0 = the heading is not held",
    )
    yaw_gyro: bool = _switch(
        False, "heading",
        "the IMU measures the yaw rate (NAO from V5 on): odometry sees a stance foot that turns",
    )
    yaw_from_lean: bool = _switch(
        True, "heading",
        "without a yaw gyro: a torso that leans shows a steady turn of the feet in its roll gyro",
    )
    heading_lean: float = _parameter(
        0.12, 0.0, 0.2, "rad", "heading",
        "how much further the torso leans for that while a heading is held; more sees more",
    )
    speed_time: float = _parameter(
        2.0, 0.0, 60.0, "s", "heading",
        "time over which a constant error of the walked speed is learned; 0 = not at all",
    )
    # -- torso orientation -------------------------------------------------------------------------
    tilt_accelerometer_time: float = _parameter(
        4.0, 0.05, 60.0, "s", "orientation", "time constant of the pull towards the accelerometer"
    )
    tilt_stance_time: float = _parameter(
        4.0, 0.05, 60.0, "s", "orientation",
        "time constant of the pull towards the flat stance sole",
    )
    tilt_stance_limit: float = _parameter(
        0.35, 0.0, 1.5, "rad", "orientation", "above this tilt the stance foot is not taken as flat"
    )
    # -- posture -----------------------------------------------------------------------------------
    gyro_pitch_gain: float = _parameter(
        0.02, -0.2, 0.2, "s", "posture", "k_p from the pitch rate to the support ankle's pitch"
    )
    gyro_pitch_rate_gain: float = _parameter(
        0.0, -0.01, 0.01, "s^2", "posture", "k_d from the pitch acceleration to the same"
    )
    gyro_roll_gain: float = _parameter(
        0.05, -0.2, 0.2, "s", "posture", "k_p from the roll rate to the support ankle's roll"
    )
    gyro_roll_rate_gain: float = _parameter(
        0.0, -0.01, 0.01, "s^2", "posture", "k_d from the roll acceleration to the same"
    )
    gyro_hip_share: float = _parameter(
        0.0, -1.0, 1.0, "", "posture", "share of these corrections that the support hip gets too"
    )
    gyro_waist_share: float = _parameter(
        0.0, -5.0, 5.0, "", "posture", "the same for the waist's pitch, on robots that have one"
    )
    gyro_shoulder_share: float = _parameter(
        0.0, -20.0, 20.0, "", "posture", "the same for pitch and roll of both shoulders"
    )
    tilt_pitch_gain: float = _parameter(
        0.8, 0.0, 1.5, "", "posture",
        "share of the torso's unwanted pitch by which the swing foot is turned back and raised",
    )
    tilt_roll_gain: float = _parameter(
        0.5, 0.0, 1.5, "", "posture", "the same for its roll"
    )
    tilt_com_gain: float = _parameter(
        0.3, 0.0, 1.5, "", "posture",
        "share of that tilt's displacement that is kept out of the CoM target",
    )
    tilt_deadband: float = _parameter(
        0.07, 0.0, 0.5, "rad", "posture", "a smaller tilt is the walk's own and is not answered"
    )
    arm_swing: float = _parameter(
        5.5, 0.0, 6.0, "rad/m", "posture",
        "how far each arm swings with the opposite foot, per distance that a foot is ahead",
    )
    # -- start, stop, fall -------------------------------------------------------------------------
    stand_time: float = _parameter(
        0.8, 0.05, 5.0, "s", "state", "time to blend from any pose into the stand"
    )
    stand_catch: float = _parameter(
        0.05, 0.0, 0.3, "m", "state",
        "a stand whose CoM's divergent component leaves by this much starts to step; 0 = never",
    )
    fall_tilt: float = _parameter(
        0.5, 0.2, 1.5, "rad", "state",
        "torso tilt, led by its rate, from which a fall is taken for unavoidable: joints relax",
    )
    fall_horizon: float = _parameter(
        0.1, 0.0, 0.5, "s", "state", "time by which the tilt's rate leads it"
    )
    get_up: bool = _switch(
        False, "state",
        "get up by itself after a fall; false = stay limp until `~/get_up` or a person",
    )

    def __post_init__(self) -> None:
        for parameter in PARAMETERS:
            parameter.check(getattr(self, parameter.name))

    def replace(self, **changes: Any) -> "GaitParameters":
        """The same parameters with some changed; an unknown or bad one raises NaoGaitError."""
        return GaitParameters.from_mapping({**self.as_dict(), **changes})

    def as_dict(self) -> dict[str, float | bool | str]:
        return {parameter.name: getattr(self, parameter.name) for parameter in PARAMETERS}

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> "GaitParameters":
        """Parameters from a mapping; what is not named keeps its default."""
        checked: dict[str, Any] = {}
        for name, value in values.items():
            parameter = BY_NAME.get(name)
            if parameter is None:
                raise NaoGaitError(str(name), value, f"one of {', '.join(BY_NAME)}")
            checked[name] = parameter.check(value)
        return cls(**checked)


@dataclass(frozen=True, slots=True)
class Parameter:
    """One row of the table."""

    name: str
    unit: str
    default: float | bool | str
    minimum: float
    maximum: float
    meaning: str
    group: str
    choices: tuple[str, ...] = ()
    """The words that it can be; empty where it is no word."""

    @property
    def is_switch(self) -> bool:
        return isinstance(self.default, bool)

    @property
    def is_number(self) -> bool:
        return not self.is_switch and not self.choices

    @property
    def allowed(self) -> str:
        if self.is_switch:
            return "true or false"
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        return f"a number from {self.minimum:g} to {self.maximum:g} {self.unit}".rstrip()

    def check(self, value: Any) -> float | bool | str:
        """The value in its own type; NaoGaitError when it is of the wrong type or out of range."""
        if self.choices:
            if isinstance(value, str) and value in self.choices:
                return value
            raise NaoGaitError(self.name, value, self.allowed)
        if self.is_switch:
            if isinstance(value, bool):
                return value
            raise NaoGaitError(self.name, value, self.allowed)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise NaoGaitError(self.name, value, self.allowed)
        if not is_number(value) or not self.minimum <= value <= self.maximum:
            raise NaoGaitError(self.name, value, self.allowed)
        return float(value)


PARAMETERS: tuple[Parameter, ...] = tuple(
    Parameter(name=field.name, default=field.default, **field.metadata)  # type: ignore[arg-type]
    for field in dataclasses.fields(GaitParameters)
)
BY_NAME: Mapping[str, Parameter] = {parameter.name: parameter for parameter in PARAMETERS}


NEEDS_RESET = ("walk", "feedback_delay")
"""Parameters that a gait takes up only when it begins anew; they cannot change while it walks."""


def load_preset(name_or_path: str | Path) -> GaitParameters:
    """Parameters of a shipped preset (`default`, `paper`) or of a YAML file.

    Raises NaoGaitError for a file that cannot be read, is not a mapping, or holds an unknown
    parameter or a value outside its range.
    """
    path = find("gait", str(name_or_path))
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise NaoGaitError(f"preset {path}", reason, "a readable YAML file") from error
    if values is None:
        values = {}
    if not isinstance(values, dict):
        raise NaoGaitError(f"preset {path}", type(values).__name__, "a mapping of parameters")
    return GaitParameters.from_mapping(values)
