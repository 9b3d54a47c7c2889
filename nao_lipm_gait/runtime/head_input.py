"""What the head's topics ask for, checked."""

from collections.abc import Sequence

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.head.gaze import PAN, TILT
from nao_lipm_gait.head.goals import Angles, Follow, Frame, Goal, LookAt, Search
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.validation import finite
from nao_lipm_gait.types import Point3

DISTANCE_ABSURD = 1000.0
"""[m]"""
MODES = ("search", "free")


def head_angles(
    names: Sequence[str], position: Sequence[float], robot: RobotDescription
) -> Angles:
    """`~/head`: pan and tilt by the names of their joints; cut at the joint limits."""
    if sorted(names) != sorted((PAN, TILT)) or len(position) != 2:
        raise NaoGaitError("~/head", list(names), f"{PAN} and {TILT} with a position each")
    found = dict(zip(names, position, strict=True))
    angles = []
    for name in (PAN, TILT):
        limit = robot.limits.get(name)
        if limit is None:
            raise NaoGaitError("~/head", name, f"a joint of {robot.name}")
        angle = finite(found[name], f"~/head position[{name}]", 100.0, "rad")
        angles.append(min(max(angle, limit.lower), limit.upper))
    return Angles(*angles)


def head_point(topic: str, point: Point3, frame_id: str, robot: RobotDescription) -> LookAt:
    """`~/look_at` or `~/follow`: a point in the frame of its header."""
    x, y, z = (
        finite(value, f"{topic} point.{axis}", DISTANCE_ABSURD, "m")
        for axis, value in zip("xyz", point, strict=True)
    )
    frames = {
        robot.torso_frame: Frame.TORSO,
        robot.base_frame: Frame.TORSO,
        Frame.FOOTPRINT.value: Frame.FOOTPRINT,
        Frame.ODOM.value: Frame.ODOM,
    }
    if frame_id not in frames:
        raise NaoGaitError(f"{topic} header.frame_id", frame_id, f"one of {', '.join(frames)}")
    return LookAt((x, y, z), frames[frame_id])


def head_follow(point: Point3, frame_id: str, robot: RobotDescription) -> Follow:
    """`~/follow`."""
    seen = head_point("~/follow", point, frame_id, robot)
    return Follow(seen.point, seen.frame)


def head_mode(text: str) -> Goal | None:
    """`~/head_mode`: `search`, or `free` to give the head back to the gait."""
    if text not in MODES:
        raise NaoGaitError("~/head_mode", text, f"one of {', '.join(MODES)}")
    return Search() if text == "search" else None
