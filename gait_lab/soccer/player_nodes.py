"""ROS parameters of the nodes of a match: referee, and the players of a scene."""

from pathlib import Path

from gait_lab.soccer.eyes import in_field
from robot_core.field import TEAMS
from sim_bridge.scene import Scene, SceneRobot

FIRST_PORT = 30000
"""UDP ports of a match begin at this plus ten times its ROS domain."""


def referee_ports(domain: int) -> dict[str, object]:
    """UDP ports of the referee; the players know the first two too, and that of their team."""
    first = FIRST_PORT + 10 * domain
    return {"control_port": first, "return_port": first + 1, "team_port": first + 2}


def player_parameters(
    robot: SceneRobot, scene: Scene, file: str | Path, domain: int
) -> dict[str, object]:
    """Parameters of a node `player`."""
    x, y, heading = in_field(robot.pose, robot.team)
    return {
        "urdf": robot.urdf,
        "scene": str(file),
        "team": robot.team,
        "number": robot.number,
        "players": sum(each.team == robot.team for each in scene.robots),
        "start": f"{x:.3f} {y:.3f} {heading:.3f}",
        **referee_ports(domain),
        "team_port": FIRST_PORT + 10 * domain + 2 + TEAMS.index(robot.team),
    }
