"""The server's robots: the names of their joints.

A joint has the name of the manufacturer in the robot file, `lle1` as the server's effector and
`llj1` as its sensor.
"""

from typing import NamedTuple

from robot_core.errors import NaoGaitError

_ARM = ("Shoulder_Pitch", "Shoulder_Roll", "Elbow_Pitch", "Elbow_Yaw")
_LEG = ("Hip_Pitch", "Hip_Roll", "Hip_Yaw", "Knee_Pitch", "Ankle_Pitch", "Ankle_Roll")


class ServerRobot(NamedTuple):
    """A robot of the server.

    Attributes:
        name: By which the server knows it.
        robot: Shipped name of the same robot here.
        effectors: Effector of each joint.
        drop_height: [m] of its torso when the referee drops it.
    """

    name: str
    robot: str
    effectors: dict[str, str]
    drop_height: float

    def sensor(self, joint: str) -> str:
        """The server's name of a joint's sensor, without `q_`."""
        return self.effectors[joint].replace("e", "j") if joint in self.effectors else ""


def _effectors(first_of_arm: str, waist: bool) -> dict[str, str]:
    """Effectors by joint; the arms' first joints have a letter before their name on K1."""
    names = {"AAHead_yaw": "he1", "Head_pitch": "he2"}
    for side, letter in (("Left", "l"), ("Right", "r")):
        for index, part in enumerate(_ARM):
            prefix = first_of_arm if index == 0 else ""
            names[f"{prefix}{side}_{part}"] = f"{letter}ae{index + 1}"
    if waist:
        names["Waist"] = "te1"
    for side, letter in (("Left", "l"), ("Right", "r")):
        for index, part in enumerate(_LEG):
            names[f"{side}_{part}"] = f"{letter}le{index + 1}"
    return names


def _robot(
    name: str, robot: str, first_of_arm: str, drop_height: float, *, waist: bool
) -> ServerRobot:
    return ServerRobot(name, robot, _effectors(first_of_arm, waist), drop_height)


ROBOTS = {
    "K1": _robot("K1", "booster_k1", "A", 1.0, waist=False),
    "T1": _robot("T1", "booster_t1", "", 0.6735, waist=True),
}


def server_robot(name: str) -> ServerRobot:
    """A robot by the server's name.

    Raises:
        NaoGaitError: The server has none of that name that is known here.
    """
    if name not in ROBOTS:
        raise NaoGaitError("robot", name, ", ".join(ROBOTS))
    return ROBOTS[name]
