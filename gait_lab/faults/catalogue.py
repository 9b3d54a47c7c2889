"""All fault classes by their names in the results."""

from collections.abc import Mapping

from gait_lab.faults import network_faults as network
from gait_lab.faults import process_faults as process
from gait_lab.faults import robot_faults as robot
from gait_lab.faults import sensor_faults as sensors
from gait_lab.faults import soccer_faults as soccer
from gait_lab.faults import stamp_faults as stamps
from gait_lab.faults.harness import Fault
from gait_lab.faults.soccer_harness import SoccerFault

FAULTS: Mapping[str, type[Fault]] = {
    "none": Fault,
    "silence": sensors.Silence,
    "frozen": sensors.Frozen,
    "joint_dropout": sensors.JointDropout,
    "nan": sensors.NotANumber,
    "spikes": sensors.Spikes,
    "bias_jump": sensors.BiasJump,
    "imu_outage": sensors.ImuOutage,
    "repeated": stamps.Repeated,
    "reordered": stamps.Reordered,
    "stamp_outliers": stamps.Outliers,
    "stamp_jitter": stamps.Jitter,
    "stamp_jump": stamps.Jump,
    "loss": network.Loss,
    "bursts": network.Bursts,
    "latency": network.Latency,
    "late_controller": network.LateController,
    "starved": network.StarvedProcessor,
    "gait_restart": process.GaitRestart,
    "bridge_reset": process.BridgeReset,
    "bridge_restart": process.BridgeRestart,
    "two_drivers": process.TwoDrivers,
    "two_gaits": process.TwoGaits,
    "parameters": process.Parameters,
    "no_commands": process.NoCommands,
    "bad_commands": process.BadCommands,
    "weak_motor": robot.WeakMotor,
    "limp_motor": robot.LimpMotor,
    "slippery": robot.SlipperyPatch,
    "picked_up": robot.PickedUp,
    "wandering_age": network.WanderingAge,
}
"""A new class goes to the end: the place of a class is part of the seeds of its runs."""
COMPARISON_FAULTS: Mapping[str, type[Fault]] = {
    "imu_gone": sensors.ImuGone,
    "imu_ignored": sensors.ImuIgnored,
}
"""Not part of the campaign: they compare stopping without an IMU with walking on."""
ALL_FAULTS: Mapping[str, type[Fault]] = {**FAULTS, **COMPARISON_FAULTS}

SOCCER_FAULTS: Mapping[str, type[SoccerFault]] = {
    "none": SoccerFault,
    "camera_black": soccer.CameraBlack,
    "camera_frozen": soccer.CameraFrozen,
    "camera_late": soccer.CameraLate,
    "vision_gone": soccer.VisionGone,
    "percepts_future": soccer.PerceptsFuture,
    "percepts_late": soccer.PerceptsLate,
    "percepts_nan": soccer.PerceptsNan,
    "mate_mute": soccer.MateMute,
    "mate_garbage": soccer.MateGarbage,
    "referee_gone": soccer.RefereeGone,
    "referee_garbage": soccer.RefereeGarbage,
    "player_restart": soccer.PlayerRestart,
}
"""Faults of `--scope soccer`."""
