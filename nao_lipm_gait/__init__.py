"""CoM-observing 3D-LIPM gait after Graf and Roefer, from Python.

    from nao_lipm_gait import Gait, Simulation, Velocity

    gait = Gait("nao_h21_v33", swing_lift=0.03)
    with Simulation("nao_h21_v33", engine="mujoco", seed=40) as sim:
        obs, targets = sim.reset(), None
        for tick in range(500):
            obs = sim.step(targets)
            if obs.frame:
                targets = gait.step(obs.frame, Velocity(0.2 if tick > 99 else 0.0))
    print(obs.truth.base_footprint)

Joint arrays (n,) [rad] follow `RobotDescription.joint_names`; SI units; x forward, y left, z up.
Bad input raises `NaoGaitError` with field, value and what is allowed.

`Gait` and `Simulation` are imported when they are first used: this module loads no physics.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import GaitState, GaitStatus, JointTargets, SensorFrame, VelocityCommand
from robot_core.types import VelocityCommand as Velocity

if TYPE_CHECKING:
    from nao_lipm_gait.gait import Gait
    from sim_bridge.simulation import Observation, Simulation

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

_WHEN_USED = {
    "Gait": "nao_lipm_gait.gait",
    "Observation": "sim_bridge.simulation",
    "Simulation": "sim_bridge.simulation",
}


def __getattr__(name: str) -> Any:
    if name not in _WHEN_USED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_WHEN_USED[name]), name)
    return value
