"""Which physics engines there are, and how to get one; none is imported before it is asked for."""

from importlib.util import find_spec

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from sim_bridge.ball import Ball
from sim_bridge.body import Body
from sim_bridge.engines.backend import Backend
from sim_bridge.individual import Individual
from sim_bridge.plant import Plant

ENGINES = ("pybullet", "mujoco")
_INSTALL = {"pybullet": "pybullet>=3.2.6", "mujoco": "mujoco>=4,<5"}
"""What pip has to install. Not our extras: on an apt ROS those would bring PyPI's rclpy along."""


def installed(engine: str) -> bool:
    """Whether the engine's own package is there."""
    return find_spec(engine) is not None


def make_backend(
    engine: str,
    robot: RobotDescription,
    plant: Plant,
    individual: Individual,
    body: Body,
    *,
    gui: bool = False,
    ball: Ball | None = None,
) -> Backend:
    """The backend of an engine, for one individual.

    Args:
        gui: open the engine's own window.
        ball: a ball on the floor.

    Raises:
        NaoGaitError: the engine is unknown or not installed, or cannot honour an option of the
            plant.
    """
    if engine not in ENGINES:
        raise NaoGaitError("engine", engine, ", ".join(ENGINES))
    if not installed(engine):
        others = [name for name in ENGINES if installed(name)]
        raise NaoGaitError(
            "engine",
            f"{engine}, which is not installed",
            ", ".join(others) + f"; or pip install '{_INSTALL[engine]}'",
        )
    if engine == "mujoco":
        from sim_bridge.engines.mujoco.backend import MujocoBackend

        return MujocoBackend(robot, plant, individual, body, gui=gui, ball=ball)
    from sim_bridge.engines.pybullet.backend import PyBulletBackend

    return PyBulletBackend(robot, plant, individual, body, gui=gui, ball=ball)
