"""Files of the repository that are written from its code: `nao_gait write`."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import yaml

from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import load_robot
from robot_core.schema import Field

PARAMETERS_HEAD = """\
# Parameters of the gait

Written by `nao_gait write parameters` from their definitions. Each is a ROS parameter of `gait` and
a key of a preset file (`preset:=my.yaml`); what a preset does not name keeps its default. Lengths,
times and speeds are those of a robot as large as a NAO. For one that is s times as large
(`nao_gait robot check`) the gait multiplies lengths by s, times and speeds by sqrt(s);
`feedback_delay` alone is the robot's own.
"""


def refresh(texts: Mapping[Path, str], check: bool, say: Callable[[str], None]) -> int:
    """Write each file that differs from its text, or with `check` only name it; the exit status."""
    different = 0
    for path, text in texts.items():
        try:
            if path.is_file() and path.read_text(encoding="utf-8") == text:
                continue
            different += 1
            if not check:
                path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise NaoGaitError("file", str(path), f"a file that can be written ({error})") from None
        say(f"{'differs' if check else 'written'}: {path}")
    return EXIT_FAILED if check and different else EXIT_OK


def parameters(check: bool, say: Callable[[str], None]) -> int:
    """docs/parameters.md."""
    return refresh({_docs() / "parameters.md": parameters_text()}, check, say)


def parameters_text() -> str:
    """The table of all gait parameters, in sections."""
    from nao_lipm_gait.parameters import PARAMETERS

    lines = [PARAMETERS_HEAD.rstrip("\n")]
    for parameter in PARAMETERS:
        if parameter.section:
            lines += ["", f"## {parameter.section}", ""]
            lines += ["| name | default | range | meaning |", "|---|---|---|---|"]
        cells = (
            f"`{parameter.name}`", _value(parameter.default),
            f"{_range(parameter)} {parameter.unit}".strip(),
            parameter.meaning.replace("|", "\\|"),
        )  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _value(value: float | bool | str) -> str:
    if isinstance(value, bool | str):
        return str(value).lower()
    text = f"{value:.10g}"
    return text if any(sign in text for sign in ".e") else f"{text}.0"


def _range(parameter: Field) -> str:
    if parameter.is_number:
        return f"{parameter.minimum:g}..{parameter.maximum:g}"
    return ", ".join(parameter.choices or ("true", "false"))


def tree(check: bool, say: Callable[[str], None]) -> int:
    """docs/behavior.mmd, a diagram in Mermaid."""
    from nao_soccer.behavior.option_tree import mermaid
    from nao_soccer.behavior.options import PLAYER

    return refresh({_docs() / "behavior.mmd": mermaid(PLAYER)}, check, say)


def urdf(check: bool, folder: Path | None, say: Callable[[str], None]) -> int:
    """The URDF of every model."""
    from gait_lab.urdf_writer import MODELS, urdf_text

    texts = {(folder or share("urdf")) / f"{name}.urdf": urdf_text(name) for name in MODELS}
    return refresh(texts, check, say)


def examples(out: Path, say: Callable[[str], None]) -> None:
    """Copy the shipped examples into a new folder."""
    try:
        shutil.copytree(share("examples"), out, ignore=shutil.ignore_patterns("__pycache__"))
    except OSError as error:
        raise NaoGaitError("--out", str(out), f"a new folder ({error.strerror})") from None
    say(f"written: {out}")


def ros2_control(urdf: str, period: float, out: Path, say: Callable[[str], None]) -> None:
    """A robot's URDF with the tag of ros2_control, and the file of its controllers."""
    model = load_robot(urdf)
    if not model.urdf.rstrip().endswith("</robot>"):
        raise NaoGaitError("--robot", urdf, "a robot whose description ends with </robot>")
    joints = model.joint_names
    described = model.urdf.rstrip().removesuffix("</robot>") + _control_tag(joints) + "</robot>\n"
    controllers: dict[str, dict[str, object]] = {
        "controller_manager": {
            "update_rate": round(1.0 / period),
            "joint_positions": {"type": "forward_command_controller/ForwardCommandController"},
        },
        # In the order of the gait's `command_interface: forward_command`.
        "joint_positions": {"joints": list(joints), "interface_name": "position"},
    }
    text = yaml.safe_dump(
        {name: {"ros__parameters": each} for name, each in controllers.items()}, sort_keys=False
    )
    out.mkdir(parents=True, exist_ok=True)
    refresh({out / "robot.urdf": described, out / "controllers.yaml": text}, False, say)


CONTROL_HARDWARE = """\
    <hardware>
      <plugin>joint_state_topic_hardware_interface/JointStateTopicSystem</plugin>
      <param name="joint_states_topic">joint_states</param>
      <param name="joint_commands_topic">joint_command</param>
      <!-- Each period: a robot without commands for a while goes limp. -->
      <param name="trigger_joint_command_threshold">-1</param>
    </hardware>
"""
"""The robot behind topics: that of `sim_bridge`. A robot of one's own has a plugin of its own."""


def _control_tag(joints: Sequence[str]) -> str:
    interfaces = "".join(
        f'    <joint name="{joint}">\n'
        '      <command_interface name="position"/>\n'
        '      <state_interface name="position"/>\n'
        '      <state_interface name="velocity"/>\n'
        "    </joint>\n"
        for joint in joints
    )
    head = '  <ros2_control name="robot" type="system">\n'
    return f"{head}{CONTROL_HARDWARE}{interfaces}  </ros2_control>\n"


def _docs() -> Path:
    return share("config").parent / "docs"
