"""The parameters of the gait: the one place where a parameter is defined.

Presets, ROS parameters and their descriptors, and docs/parameters.md are made from the fields of
`GaitParameters`. To add a parameter, add one field here and use it; then run
`nao_gait write parameters`.
"""

from collections.abc import Mapping
from pathlib import Path

import attrs

from nao_lipm_gait.walk_engines import WALKS
from robot_core import schema
from robot_core.resources import find
from robot_core.schema import Settings, choice, number, switch


@attrs.frozen
class GaitParameters(Settings):
    """Everything that can be tuned, in SI units. Each field holds its unit, range and meaning."""

    walk: str = choice(
        tuple(WALKS),
        f"Walk engine: {', '.join(f'{name} = {each.meaning}' for name, each in WALKS.items())}.",
        section="Walk engine",
    )

    pendulum_height: float = number(
        0.24, 0.1, 0.6, "m", "Height h of the pendulum; sets k = sqrt(g/h).",
        section="Pendulum",
    )
    pendulum_width: float = number(
        0.04, 0.005, 0.1, "m",
        "(x0)_y: lateral distance of the CoM from the pendulum origin where it turns back; a "
        "larger value shortens the steps' duration.",
    )
    pendulum_offset_y: float = number(
        0.05, 0.02, 0.12, "m", "r_y: lateral distance of the pendulum origin from Q."
    )
    pendulum_shift_max: float = number(
        0.045, 0.0, 0.08, "m",
        "Largest shift r_x of the pendulum origin towards the toes; beyond it the step size "
        "changes.",
    )
    pendulum_shift_back_max: float = number(
        0.036, 0.0, 0.08, "m", "Largest shift r_x of the pendulum origin towards the heel."
    )
    pendulum_hold_time: float = number(
        0.06, 0.0, 0.1, "s",
        "Last time of a step in which r_x is held and the step size follows instead; 0 = never, as "
        "in the paper.",
    )
    pendulum_shift_side_max: float = number(
        0.055, 0.0, 0.06, "m",
        "Largest outward shift of the pendulum origin inside the sole if the CoM returns too late.",
    )
    step_duration_min: float = number(
        0.12, 0.05, 0.5, "s", "Shortest time between two support changes."
    )

    zmp_step_duration: float = number(
        0.35, 0.1, 2.0, "s", "T/2: duration of one step (half a stride).",
        section="ZMP walk and preview control",
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
    preview_time: float = number(0.8, 0.1, 3.0, "s", "Preview horizon of the desired ZMP.")

    com_height: float = number(
        0.24, 0.15, 0.4, "m", "Height of the whole-body CoM above the soles.", section="Stance"
    )
    foot_spacing: float = number(0.12, 0.08, 0.2, "m", "Lateral distance between the ankles.")
    foot_reference_x: float = number(
        0.0205, -0.03, 0.06, "m",
        "Preferred distance of the pendulum origin ahead of the ankle (where r_x = 0).",
    )
    torso_pitch: float = number(
        0.04, -0.3, 0.3, "rad", "Forward lean of the torso while walking."
    )

    swing_lift: float = number(
        0.03, 0.0, 0.06, "m", "Greatest height of the swing foot.", section="Swing foot"
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

    step_forward_max: float = number(
        0.131, 0.0, 0.2, "m", "Largest forward step size.", section="Step sizes"
    )
    step_backward_max: float = number(0.118, 0.0, 0.2, "m", "Largest backward step size.")
    step_side_max: float = number(
        0.172, 0.0, 0.3, "m", "Largest sum of the side steps of both feet (one double step)."
    )
    step_turn_max: float = number(
        1.5, 0.0, 2.0, "rad", "Largest sum of the turns of both feet (one double step)."
    )
    step_limit_norm: float = number(
        1.0, 1.0, 4.0, "",
        "Exponent that combines the limits of mixed directions: 1 = sum of the shares, 2 = "
        "ellipsoid.",
    )
    step_mixed_weight: float = number(
        1.7, 1.0, 4.0, "",
        "Weight of the smaller shares in that combination; a larger value shortens the steps of "
        "curves and diagonals.",
    )
    step_side_share: float = number(
        0.8, 0.5, 1.0, "",
        "Share of a side step that the leading foot takes; the trailing foot takes the rest.",
    )
    step_turn_share: float = number(
        0.5, 0.5, 1.0, "",
        "Share of a turn that the opening foot takes; the closing foot takes the rest.",
    )
    step_forward_rate: float = number(
        0.02, 0.001, 0.2, "m", "Largest change of the forward step size from step to step."
    )
    step_side_rate: float = number(
        0.03, 0.001, 0.2, "m", "Largest change of the side step size from step to step."
    )
    step_turn_rate: float = number(
        0.2, 0.01, 1.5, "rad", "Largest change of the turn from step to step."
    )
    step_stretch_max: float = number(
        0.065, 0.0, 0.2, "m",
        "Distance by which feedback may move the next foot beyond the step limits in x.",
    )
    step_travel_max: float = number(
        0.21, 0.05, 0.4, "m",
        "Longest path of a swing foot in x, that is the sum of two successive steps.",
    )
    step_capture: float = number(
        0.5, 0.0, 1.0, "",
        "Step size while r_x is at its limit: 0 = the step that keeps the CoM velocity, 1 = the "
        "step that corrects it.",
    )
    step_capture_back: float = number(
        0.15, 0.0, 1.0, "", "As step_capture, for a step that must reach further back."
    )
    step_catch_out: float = number(
        0.06, 0.0, 0.15, "m", "Distance by which feedback may move the next foot outwards."
    )
    step_catch_in: float = number(
        0.03, 0.0, 0.05, "m", "Distance by which feedback may move the next foot inwards."
    )
    step_hurry: float = number(
        0.09, 0.0, 1.0, "m",
        "Shorten the step's duration if the CoM needs a step this much longer than commanded; 1 = "
        "never.",
    )

    feedback: bool = switch(
        True,
        "Correct the pendulum with the observed CoM and the posture with the gyro; false = open "
        "loop.",
        section="CoM observer",
    )
    feedback_delay: float = number(
        0.06, 0.0, 0.2, "s", "Sensor delay plus motor lag that the prediction bridges."
    )
    position_sigma: float = number(
        0.0001, 0.0, 0.1, "m", "Standard deviation of the CoM position's process noise per tick."
    )
    velocity_sigma: float = number(
        0.004, 0.0, 1.0, "m/s", "Standard deviation of the CoM velocity's process noise per tick."
    )
    measurement_sigma: float = number(
        0.02, 0.0001, 1.0, "m",
        "Standard deviation of the measured CoM; a smaller value trusts the measurement more.",
    )
    offset_time: float = number(
        3.0, 0.0, 60.0, "s",
        "Time constant for learning constant errors of the measured CoM; 0 = off.",
    )
    push_velocity: float = number(
        0.14, 0.0, 1.0, "m/s",
        "Detect a push if the measured CoM moves this much faster than expected; 0 = off.",
    )
    push_acceleration: bool = switch(
        True, "Detect pushes with the accelerometer too, before the CoM has moved."
    )
    sway_limit: float = number(
        0.0022, 0.0, 0.05, "m",
        "Strides become shorter if the measured CoM sways more than this (standard deviation to "
        "the side, beyond what is expected); 0 = off.",
    )

    heading_gain: float = number(
        1.5, 0.0, 5.0, "1/s",
        "Turning rate per heading error while no turn is commanded; 0 = do not hold the heading.",
        section="Heading and speed",
    )
    yaw_gyro: bool = switch(
        False,
        "The IMU measures the yaw rate (NAO V5 and later); odometry then measures the yaw slip of "
        "the stance foot.",
    )
    yaw_from_lean: bool = switch(
        True,
        "Without a yaw gyro, estimate the yaw slip of the feet from the roll rate of the leaning "
        "torso.",
    )
    heading_lean: float = number(
        0.12, 0.0, 0.2, "rad",
        "Additional torso lean for that estimate while a heading is held; more lean improves it.",
    )
    speed_time: float = number(
        2.0, 0.0, 60.0, "s",
        "Time constant for learning a constant error of the walking speed; 0 = off.",
    )

    tilt_accelerometer_time: float = number(
        4.0, 0.05, 60.0, "s",
        "Time constant of the correction of the torso's tilt by the accelerometer.",
        section="Torso orientation",
    )
    tilt_stance_time: float = number(
        4.0, 0.05, 60.0, "s",
        "Time constant of the correction of the torso's tilt by the flat stance sole.",
    )

    level_soles: bool = switch(
        True,
        "Learn by how much the soles are not parallel (encoder offsets) and correct both ankles.",
        section="Sole levelling",
    )

    gyro_pitch_gain: float = number(
        0.02, -0.2, 0.2, "s", "k_p from the pitch rate to the pitch of the support ankle.",
        section="Posture",
    )
    gyro_pitch_rate_gain: float = number(
        0.0, -0.01, 0.01, "s^2",
        "k_d from the pitch acceleration to the pitch of the support ankle.",
    )
    gyro_roll_gain: float = number(
        0.05, -0.2, 0.2, "s", "k_p from the roll rate to the roll of the support ankle."
    )
    gyro_roll_rate_gain: float = number(
        0.0, -0.01, 0.01, "s^2", "k_d from the roll acceleration to the roll of the support ankle."
    )
    gyro_hip_share: float = number(
        0.0, -1.0, 1.0, "", "Share of the gyro corrections that is added to the support hip."
    )
    gyro_waist_share: float = number(
        0.0, -5.0, 5.0, "",
        "Share of the pitch correction that is added to the waist, on robots that have one.",
    )
    gyro_shoulder_share: float = number(
        0.0, -20.0, 20.0, "",
        "Share of the gyro corrections that is added to pitch and roll of both shoulders.",
    )
    tilt_pitch_gain: float = number(
        0.8, 0.0, 1.5, "",
        "Share of the torso's pitch error by which the swing foot is rotated back and raised.",
    )
    tilt_roll_gain: float = number(
        0.5, 0.0, 1.5, "",
        "Share of the torso's roll error by which the swing foot is rotated back and raised.",
    )
    tilt_com_gain: float = number(
        0.3, 0.0, 1.5, "",
        "Share of the CoM displacement caused by the torso's tilt that is removed from the CoM "
        "target.",
    )
    arm_swing: float = number(
        5.5, 0.0, 6.0, "rad/m",
        "Swing of each arm per metre by which the opposite foot is ahead.",
    )

    stand_time: float = number(
        0.8, 0.05, 5.0, "s", "Time to move from any pose to the stand.",
        section="Start, stop, fall",
    )
    stand_catch: float = number(
        0.05, 0.0, 0.3, "m",
        "Start to step from a stand if the divergent component of the CoM moves by this much; 0 = "
        "never.",
    )
    fall_tilt: float = number(
        0.5, 0.2, 1.5, "rad",
        "Torso tilt, predicted over fall_horizon, above which a fall is detected and the joints "
        "relax.",
    )
    fall_horizon: float = number(
        0.1, 0.0, 0.5, "s", "Time over which the tilt is predicted for fall detection."
    )
    get_up: bool = switch(
        False, "Get up automatically after a fall; false = stay relaxed until `~/get_up`."
    )


PARAMETERS: tuple[schema.Field, ...] = schema.fields(GaitParameters)
BY_NAME: Mapping[str, schema.Field] = {parameter.name: parameter for parameter in PARAMETERS}

NEEDS_RESET = ("walk", "feedback_delay")
"""Parameters that a gait reads only when it restarts; they cannot change while it walks."""


def load_preset(name_or_path: str | Path) -> GaitParameters:
    """Load a shipped preset (`default`, `paper`) or a YAML file.

    A preset names only what differs from the defaults. Raises NaoGaitError for a file that cannot
    be read, an unknown parameter or a value that is not allowed.
    """
    path = find("gait", str(name_or_path))
    values = schema.read_yaml(path, "preset")
    return GaitParameters.from_mapping({} if values is None else values, f"preset {path}: ")
