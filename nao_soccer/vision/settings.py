"""What vision looks for on the field of a scene, and how far the camera can be trusted."""

from pathlib import Path

import attrs

from nao_soccer.vision.image_geometry import PoseError
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.field import Field, Goals, Pole
from robot_core.resources import find
from robot_core.schema import Settings, group, number


@attrs.frozen
class VisionSettings(Settings):
    """What is on the field, and the errors of the camera's pose."""

    field: Field = group(Field, Field(), "The field.")
    goals: Goals | None = schema.field(schema.Group(Goals), None, "The goals; null = none.")
    poles: tuple[Pole, ...] = schema.field(
        schema.Sequence(schema.Group(Pole)), (), "Landmarks; only their size and colours are used."
    )
    ball_radius: float = number(0.05, 0.02, 0.2, "m", "Radius of the ball.")
    error: PoseError = group(PoseError, PoseError(), "Errors of the camera's pose.")


def settings_of_scene(name_or_path: str | Path) -> VisionSettings:
    """What a scene says about the field; its robots are not read.

    Raises:
        NaoGaitError: The file cannot be used, or the scene has no field.
    """
    path = find("scenes", name_or_path)
    scene = schema.read_yaml(path, "scene")
    where = f"scene {path}"
    if not isinstance(scene, dict) or scene.get("field") is None:
        raise NaoGaitError(f"{where}: field", "nothing", "a scene with a field")
    ball = scene.get("ball") or {}
    found = {key: scene[key] for key in ("field", "goals", "poles") if scene.get(key) is not None}
    if isinstance(ball, dict) and "radius" in ball:
        found["ball_radius"] = ball["radius"]
    return VisionSettings.from_mapping(found, f"{where}: ")
