"""Which physics engines there are. An engine is imported only when it is used."""

import os
import sys
from collections.abc import Iterable, Sequence
from importlib.util import find_spec

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.schema import Choice
from sim_bridge.engines.backend import Backend, RobotModel
from sim_bridge.surroundings import PLAIN_FLOOR, Surroundings

ENGINES = ("pybullet", "mujoco")
_INSTALL = {"pybullet": "pybullet>=3.2.6", "mujoco": "mujoco>=4,<5"}
"""Requirement for pip. Not an extra of this package: with ROS from apt, an extra would also install
rclpy from PyPI."""


def installed(engine: str) -> bool:
    """Whether the engine's own package is installed."""
    return find_spec(engine) is not None


def check_installed(engine: str) -> None:
    """Raise NaoGaitError, which says how to get it, if an engine of `ENGINES` is not installed."""
    if not installed(engine):
        others = [f"engine:={name}, which is installed" for name in ENGINES if installed(name)]
        allowed = "; or ".join((*others, f"pip install '{_INSTALL[engine]}'"))
        raise NaoGaitError("engine", engine, allowed)


def engine_for(robots: Iterable[RobotDescription]) -> str:
    """The engine with which these robots are simulated if none is asked for."""
    return "mujoco" if any(each.soft_joint for each in robots) else "pybullet"


def make_backend(
    engine: str,
    robots: Sequence[RobotModel],
    surroundings: Surroundings = PLAIN_FLOOR,
    *,
    gui: bool = False,
    visual: bool = False,
) -> Backend:
    """The backend of an engine.

    Args:
        engine: One of `ENGINES`.
        robots: The individuals; all have the same physics and floor.
        surroundings: What is around the robots.
        gui: Open the engine's own window.
        visual: With what can be seen; always so with `gui`.

    Raises:
        NaoGaitError: The engine is unknown or not installed, cannot honour an option of the plant
            or the surroundings, or cannot open a window.
    """
    engine = Choice(ENGINES).check("engine", engine)
    check_installed(engine)
    if gui and sys.platform == "linux" and not os.environ.get("DISPLAY"):
        # Without a display the engines end the process.
        allowed = "false, because DISPLAY is not set; to see the robot, open `nao_gait view`"
        raise NaoGaitError("gui", gui, allowed)
    if engine == "mujoco":
        from sim_bridge.engines.mujoco.backend import MujocoBackend

        return MujocoBackend(robots, surroundings, gui=gui, visual=visual)
    from sim_bridge.engines.pybullet.backend import PyBulletBackend

    return PyBulletBackend(robots, surroundings, gui=gui, visual=visual)
