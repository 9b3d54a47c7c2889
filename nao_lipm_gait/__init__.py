"""CoM-observing 3D-LIPM gait after Graf and Roefer, from Python.

    from nao_lipm_gait import Gait, Simulation, Velocity

    gait = Gait("nao_h21_v33", swing_lift=0.025)
    with Simulation("nao_h21_v33", engine="mujoco", seed=40) as sim:
        obs, targets = sim.reset(), None
        for tick in range(500):
            obs = sim.step(targets)
            if obs.frame:
                targets = gait.step(obs.frame, Velocity(0.2 if tick > 99 else 0.0))
    print(obs.truth.base_footprint)

Joint arrays (n,) [rad] follow `RobotDescription.joint_names`; SI units; x forward, y left, z up.
Bad input raises `NaoGaitError` with field, value and what is allowed.

Each name is imported when it is first used: the import of the package costs nothing, and a node of
it can be interrupted from the start.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nao_lipm_gait.gait import Gait
    from nao_lipm_gait.parameters import GaitParameters, load_preset
    from robot_core.errors import NaoGaitError
    from robot_core.robot import RobotDescription, load_robot
    from robot_core.types import GaitState, GaitStatus, JointTargets, SensorFrame, VelocityCommand
    from robot_core.types import VelocityCommand as Velocity
    from sim_bridge.simulation import Observation, Simulation

__version__ = "0.3.0"

__all__ = [
    "Gait",
    "GaitParameters",
    "GaitState",
    "GaitStatus",
    "JointTargets",
    "NaoGaitError",
    "Observation",
    "RobotDescription",
    "SensorFrame",
    "Simulation",
    "Velocity",
    "VelocityCommand",
    "load_preset",
    "load_robot",
]

_MODULES = {
    "nao_lipm_gait.gait": ("Gait",),
    "nao_lipm_gait.parameters": ("GaitParameters", "load_preset"),
    "robot_core.errors": ("NaoGaitError",),
    "robot_core.robot": ("RobotDescription", "load_robot"),
    "robot_core.types": (
        "GaitState", "GaitStatus", "JointTargets", "SensorFrame", "VelocityCommand",
    ),
    "sim_bridge.simulation": ("Observation", "Simulation"),
}  # fmt: skip


def __getattr__(name: str) -> Any:
    wanted = "VelocityCommand" if name == "Velocity" else name
    for module, names in _MODULES.items():
        if wanted in names:
            value = globals()[name] = getattr(import_module(module), wanted)
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


if "gymnasium" in sys.modules:
    import_module("nao_lipm_gait.gym")
