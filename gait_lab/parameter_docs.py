"""Writes docs/parameters.md from the fields of `GaitParameters`.

`python -m gait_lab.parameter_docs` writes the file; `--check` only compares and fails on a
difference.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from nao_lipm_gait.parameters import PARAMETERS
from robot_core.resources import share
from robot_core.schema import Field

HEAD = """\
# Parameters of the gait

Written by `python -m gait_lab.parameter_docs` from `nao_lipm_gait/parameters.py`, the
one place where a parameter is defined. Each is a ROS parameter of the node `gait` and a
key of a preset file (`preset:=my.yaml`); what a preset does not name keeps its default.
"""


def _value(value: float | bool | str) -> str:
    if isinstance(value, bool | str):
        return str(value).lower()
    text = f"{value:.10g}"
    return text if any(sign in text for sign in ".e") else f"{text}.0"


def _range(parameter: Field) -> str:
    if parameter.is_number:
        return f"{parameter.minimum:g} to {parameter.maximum:g}"
    return ", ".join(parameter.choices or ("true", "false"))


def table_text() -> str:
    """The text of docs/parameters.md."""
    lines = [HEAD.rstrip("\n")]
    for parameter in PARAMETERS:
        if parameter.section:
            lines += ["", f"## {parameter.section}", ""]
            lines += ["| name | default | range | unit | meaning |", "|---|---|---|---|---|"]
        cells = (
            f"`{parameter.name}`", _value(parameter.default), _range(parameter), parameter.unit,
            parameter.meaning.replace("|", "\\|"),
        )  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def document() -> Path:
    """The path of docs/parameters.md."""
    return share("config").parent / "docs" / "parameters.md"


def main(args: Sequence[str] | None = None) -> int:
    """Write or compare the document; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m gait_lab.parameter_docs",
        description="Write docs/parameters.md from the code.",
    )
    parser.add_argument("--check", action="store_true", help="compare only; 1 if the file differs")
    options = parser.parse_args(args)
    path, text = document(), table_text()
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        return 0
    if options.check:
        sys.stderr.write(f"{path} is out of date: run python -m gait_lab.parameter_docs\n")
        return 1
    path.write_text(text, encoding="utf-8")
    sys.stdout.write(f"written: {path}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
