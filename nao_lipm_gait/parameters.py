"""The parameters of the gait: one table, from which everything else about them is made.

`GaitParameters` holds what every walk engine has. Each engine adds its own in `parameters.py` of
its folder, as a subclass; a parameter that an engine does not have is refused. Names are flat:
presets, ROS parameters and Python use the same ones. To add a parameter, add one field and use it;
then run `nao_gait write parameters`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self, cast

import attrs

from nao_lipm_gait.walk_engines import WALKS, load_class
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import find, read_layers
from robot_core.schema import Settings, choice, number, switch


@attrs.frozen
class GaitParameters(Settings):
    """Everything that can be tuned, in SI units. Each field holds its unit, range and meaning.

    `GaitParameters(walk="zmp")` makes the parameters of that engine, an instance of a subclass.
    """

    walk: str = choice(
        tuple(WALKS),
        f"Walk engine: {', '.join(f'{name} = {each.meaning}' for name, each in WALKS.items())}.",
        section="Walk engine",
    )

    com_height: float = number(
        0.24, 0.15, 0.4, "m", "Height of the whole-body CoM above the soles.",
        section="Stance",
    )
    foot_spacing: float = number(0.12, 0.08, 0.2, "m", "Lateral distance between the ankles.")
    foot_reference_x: float = number(
        0.0205, -0.03, 0.06, "m",
        "Preferred distance of the pendulum origin ahead of the ankle (where r_x = 0).",
    )
    torso_pitch: float = number(
        0.04, -0.3, 0.3, "rad", "Forward lean of the torso while walking."
    )

    pendulum_height: float = number(
        0.24, 0.1, 0.6, "m", "Height h of the pendulum; sets k = sqrt(g/h).",
        section="Pendulum",
    )
    pendulum_width: float = number(
        0.04, 0.005, 0.1, "m",
        "(x0)_y: lateral distance of the CoM from the pendulum origin where it turns back; a "
        "larger value shortens the steps' duration.",
    )
    pendulum_offset_y: float = number(
        0.05, 0.02, 0.12, "m", "r_y: lateral distance of the pendulum origin from Q."
    )

    step_forward_max: float = number(
        0.108, 0.0, 0.2, "m",
        "Largest forward step size. Commands beyond the step sizes are walked at them.",
        section="Step sizes",
    )
    step_backward_max: float = number(0.094, 0.0, 0.2, "m", "Largest backward step size.")
    step_side_max: float = number(
        0.145, 0.0, 0.3, "m", "Largest sum of the side steps of both feet (one double step)."
    )
    step_turn_max: float = number(
        1.05, 0.0, 2.0, "rad", "Largest sum of the turns of both feet (one double step)."
    )
    step_side_share: float = number(
        0.8, 0.5, 1.0, "",
        "Share of a side step that the leading foot takes; the trailing foot takes the rest.",
    )
    step_turn_share: float = number(
        0.5, 0.5, 1.0, "",
        "Share of a turn that the opening foot takes; the closing foot takes the rest.",
    )
    step_forward_rate: float = number(
        0.02, 0.001, 0.2, "m", "Largest change of the forward step size from step to step."
    )
    step_turn_rate: float = number(
        0.2, 0.01, 1.5, "rad", "Largest change of the turn from step to step."
    )

    swing_lift: float = number(
        0.03, 0.0, 0.06, "m", "Greatest height of the swing foot.",
        section="Swing foot",
    )
    kick_reach: float = number(
        0.08, 0.0, 0.15, "m",
        "How far a foot that kicks in the walk swings beyond its way; slow motors make less of it.",
    )

    feedback: bool = switch(
        True,
        "Correct the pendulum with the observed CoM and the posture with the gyro; false = open "
        "loop.",
        section="Feedback",
    )
    feedback_delay: float = number(
        0.06, 0.0, 0.2, "s", "Sensor delay plus motor lag that the prediction bridges."
    )

    heading_gain: float = number(
        1.5, 0.0, 5.0, "1/s",
        "Turning rate per heading error while no turn is commanded; 0 = do not hold the heading.",
        section="Heading and speed",
    )
    yaw_from_lean: bool = switch(
        True,
        "Without a yaw gyro, estimate the yaw slip of the feet from the roll rate of the torso, "
        "which leans further forward while a heading is held.",
    )
    speed_time: float = number(
        2.0, 0.0, 60.0, "s",
        "Time constant for learning a constant error of the walking speed; 0 = off.",
    )

    level_soles: bool = switch(
        True,
        "Learn by how much the soles are not parallel (encoder offsets) and correct both ankles.",
        section="Soles",
    )
    follow_ground: bool = switch(
        True, "Turn the soles with ground that slopes or steps, and keep the torso upright on it."
    )

    gyro_pitch_gain: float = number(
        0.02, -0.2, 0.2, "s", "k_p from the pitch rate to the pitch of the support ankle.",
        section="Posture",
    )
    gyro_roll_gain: float = number(
        0.05, -0.2, 0.2, "s", "k_p from the roll rate to the roll of the support ankle."
    )
    tilt_pitch_gain: float = number(
        0.8, 0.0, 1.5, "",
        "Share of the torso's pitch error by which the swing foot is rotated back and raised; 0 = "
        "neither pitch nor roll is compensated.",
    )
    arm_swing: float = number(
        5.5, 0.0, 12.0, "rad/m",
        "Swing of each arm per metre by which the opposite foot is ahead.",
    )

    stand_catch: float = number(
        0.05, 0.0, 0.3, "m",
        "Start to step from a stand if the divergent component of the CoM moves by this much; 0 = "
        "never.",
        section="Start and fall",
    )
    get_up: bool = switch(
        False, "Get up automatically after a fall; false = stay relaxed until `~/get_up`."
    )

    @property
    def stance_time(self) -> float:
        """[s] Time constant of the correction of the torso's tilt by the flat stance sole."""
        return 4.0

    def __new__(cls, **values: Any) -> "GaitParameters":
        """An instance of the subclass of the walk engine."""
        kind = cls
        if cls is GaitParameters:
            kind = _of_walk(values.get("walk", _DEFAULT_WALK))
        return object.__new__(kind)

    @classmethod
    def checked(cls, values: Any, where: str = "", *, partial: bool = False) -> dict[str, Any]:
        """Check a mapping; with `partial` and without `walk`, for any engine that has its keys."""
        if not isinstance(values, Mapping):
            return super().checked(values, where, partial=partial)
        if cls is GaitParameters:
            if partial and "walk" not in values:
                kinds = map(_of_walk, WALKS)
                having = (kind for kind in kinds if all(key in _names(kind) for key in values))
                kind = next(having, _of_walk(_DEFAULT_WALK))
            else:
                kind = _of_walk(values.get("walk", _DEFAULT_WALK), where)
            return kind.checked(values, where, partial=partial)
        for key, value in values.items():
            if key in BY_NAME and key not in _names(cls):
                walks = [walk for walk in WALKS if key in _names(_of_walk(walk))]
                allowed = f"only with walk: {' or '.join(walks)}"
                raise NaoGaitError(schema.join(where, key), value, allowed)
        return super().checked(values, where, partial=partial)

    def replace(self, **changes: Any) -> Self:
        """A copy with some parameters changed; NaoGaitError for an unknown name or bad value.

        Another `walk` keeps what both engines have; the rest gets the defaults of the new engine.
        """
        return cast(Self, GaitParameters.from_mapping({**self._kept(changes), **changes}))

    def _kept(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """The values that these changes leave as they are."""
        kind = _of_walk(changes.get("walk", self.walk))
        return {name: value for name, value in self.as_dict().items() if name in _names(kind)}


_DEFAULT_WALK = next(iter(WALKS))


def _of_walk(walk: object, where: str = "") -> type[GaitParameters]:
    """The parameters of a walk engine; NaoGaitError if there is no such engine."""
    if not isinstance(walk, str) or walk not in WALKS:
        raise NaoGaitError(schema.join(where, "walk"), walk, WALKS)
    kind: type[GaitParameters] = load_class(WALKS[walk].parameters)
    return kind


def _names(kind: type[GaitParameters]) -> set[str]:
    return {field.name for field in schema.fields(kind)}


def _table() -> dict[str, schema.Field]:
    table = {field.name: field for field in schema.fields(GaitParameters)}
    for walk in WALKS:
        for field in schema.fields(_of_walk(walk)):
            table.setdefault(field.name, field)
    return table


BY_NAME: Mapping[str, schema.Field] = _table()
"""The parameters of all walk engines."""
PARAMETERS: tuple[schema.Field, ...] = tuple(BY_NAME.values())

NEEDS_RESET = ("walk", "feedback_delay")
"""Parameters that a gait reads only when it restarts; they cannot change while it walks."""


def load_preset(name_or_path: str | Path) -> GaitParameters:
    """Load a shipped preset (`default`, `paper`) or a YAML file.

    A preset names only what differs from the defaults, or from the preset that it names as its
    `base`. Raises NaoGaitError for a file that cannot be read, an unknown parameter, one that its
    walk engine does not have, or a value that is not allowed.
    """
    path = find("gait", str(name_or_path))
    layers = read_layers(path, "preset", "gait")
    values = {key: value for _, values in layers for key, value in values.items()}
    return GaitParameters.from_mapping(values, f"preset {path}: ")
