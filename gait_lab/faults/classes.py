"""Every class of faults by its name in the table."""

from collections.abc import Mapping

from gait_lab.faults import network_faults as network
from gait_lab.faults import process_faults as life
from gait_lab.faults import robot_faults as body
from gait_lab.faults import sensor_faults as sensors
from gait_lab.faults import stamp_faults as stamps
from gait_lab.faults.fault import Fault

CLASSES: Mapping[str, type[Fault]] = {
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
    "gait_restart": life.GaitRestart,
    "bridge_reset": life.BridgeReset,
    "bridge_restart": life.BridgeRestart,
    "two_drivers": life.TwoDrivers,
    "two_gaits": life.TwoGaits,
    "parameters": life.Parameters,
    "no_commands": life.Silent,
    "bad_commands": life.BadCommands,
    "weak_motor": body.WeakMotor,
    "limp_motor": body.LimpMotor,
    "slippery": body.SlipperyPatch,
    "picked_up": body.PickedUp,
}
COMPARED: Mapping[str, type[Fault]] = {
    "imu_gone": sensors.ImuGone,
    "imu_ignored": sensors.ImuIgnored,
}
"""Not part of the campaign: what a decision was made by. The last one is not the gait as it is."""
ALL: Mapping[str, type[Fault]] = {**CLASSES, **COMPARED}
