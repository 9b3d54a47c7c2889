"""Writes what people read about the gait's parameters, from the one table in the code.

`python -m gait_lab.parameter_docs` writes config/gait/default.yaml and docs/parameters.md;
`--check` only compares, and fails on a difference.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

from nao_lipm_gait.parameters import PARAMETERS, Parameter
from nao_lipm_gait.resources import share

TITLES = {
    "walk": "Which walk",
    "zmp": "ZMP walk and preview control",
    "preview": "Preview control",
    "pendulum": "Pendulum",
    "stance": "Stance",
    "swing": "Swing foot",
    "step": "Step sizes",
    "observer": "CoM observer",
    "heading": "Heading",
    "orientation": "Torso orientation",
    "posture": "Posture control by the gyro",
    "state": "Start, stop, fall",
}


def _value(parameter: Parameter, value: float | bool | str) -> str:
    if isinstance(value, str):
        return value
    if parameter.is_switch:
        return "true" if value else "false"
    text = f"{value:.10g}"
    return text if any(sign in text for sign in ".e") else f"{text}.0"


def _range(parameter: Parameter) -> str:
    if parameter.is_switch:
        return "true, false"
    if parameter.choices:
        return ", ".join(parameter.choices)
    return f"{parameter.minimum:g} to {parameter.maximum:g}"


def _groups() -> Iterator[tuple[str, list[Parameter]]]:
    for group, parameters in groupby(PARAMETERS, key=lambda parameter: parameter.group):
        yield TITLES[group], list(parameters)


def preset_text() -> str:
    """The preset `default`, every parameter with its unit, range and meaning."""
    lines = [
        "# The shipped walk: every parameter of the gait with its default. SI units.",
        "# Written by `python -m gait_lab.parameter_docs` from nao_lipm_gait/parameters.py.",
    ]
    for title, parameters in _groups():
        lines += ["", f"# -- {title}"]
        for parameter in parameters:
            unit = f" [{parameter.unit}]" if parameter.unit else ""
            lines.append(f"# {parameter.meaning}{unit}; {_range(parameter)}")
            lines.append(f"{parameter.name}: {_value(parameter, parameter.default)}")
    return "\n".join(lines) + "\n"


def table_text() -> str:
    """docs/parameters.md."""
    lines = [
        "# Parameters of the gait",
        "",
        "Written by `python -m gait_lab.parameter_docs` from `nao_lipm_gait/parameters.py`, the",
        "one place where a parameter is defined. Each is a ROS parameter of the node `gait` and a",
        "key of a preset file (`preset:=my.yaml`); what a preset does not name keeps its default.",
    ]
    for title, parameters in _groups():
        lines += ["", f"## {title}", "", "| name | default | range | unit | meaning |"]
        lines.append("|---|---|---|---|---|")
        for parameter in parameters:
            meaning = parameter.meaning.replace("|", "\\|")
            lines.append(
                f"| `{parameter.name}` | {_value(parameter, parameter.default)} "
                f"| {_range(parameter)} | {parameter.unit} | {meaning} |"
            )
    return "\n".join(lines) + "\n"


def documents() -> dict[Path, str]:
    """The files and what they should hold."""
    root = share("config").parent
    return {
        root / "config" / "gait" / "default.yaml": preset_text(),
        root / "docs" / "parameters.md": table_text(),
    }


def main(args: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m gait_lab.parameter_docs",
        description="Write the preset and the table of parameters from the code.",
    )
    parser.add_argument("--check", action="store_true", help="compare only; 1 if a file differs")
    options = parser.parse_args(args)
    different = 0
    for path, text in documents().items():
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            continue
        different += 1
        if not options.check:
            path.write_text(text, encoding="utf-8")
        sys.stdout.write(f"{'differs' if options.check else 'written'}: {path}\n")
    return 1 if options.check and different else 0


if __name__ == "__main__":
    raise SystemExit(main())
