"""Which physics engines there are. An engine is imported only when it is used."""

from collections.abc import Sequence
from importlib.util import find_spec

from nao_lipm_gait.errors import NaoGaitError
from sim_bridge.ball import Ball
from sim_bridge.engines.backend import Backend, RobotModel
from sim_bridge.terrain import Prism

ENGINES = ("pybullet", "mujoco")
_INSTALL = {"pybullet": "pybullet>=3.2.6", "mujoco": "mujoco>=4,<5"}
"""Requirement for pip. Not an extra of this package: with ROS from apt, an extra would also install
rclpy from PyPI."""


def installed(engine: str) -> bool:
    """Whether the engine's own package is installed."""
    return find_spec(engine) is not None


def make_backend(
    engine: str,
    robots: Sequence[RobotModel],
    ground: tuple[Prism, ...] = (),
    *,
    gui: bool = False,
    ball: Ball | None = None,
) -> Backend:
    """The backend of an engine.

    Args:
        engine: one of `ENGINES`.
        robots: the individuals; all have the same physics and floor.
        ground: prisms that rise above the floor.
        gui: open the engine's own window.
        ball: ball on the floor; None = none.

    Raises:
        NaoGaitError: the engine is unknown or not installed, or cannot honour an option of the
            plant or the number of robots.
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

        return MujocoBackend(robots, ground, gui=gui, ball=ball)
    from sim_bridge.engines.pybullet.backend import PyBulletBackend

    return PyBulletBackend(robots, ground, gui=gui, ball=ball)
