"""The compiled gait: the same source through mypyc, which gives the same walk to the bit."""

import hashlib
from functools import cache
from pathlib import Path

import robot_core.geometry
import sim_bridge
from robot_core.errors import NaoGaitError

PACKAGES = ("robot_core", "nao_lipm_gait")
SOURCE = Path(sim_bridge.__file__).resolve().parents[1]
"""The folder with the packages that are compiled."""
MADE_OF = "made_of.txt"
"""File in the folder of a compiled gait that names its source; it begins with a hash of it."""


def is_compiled() -> bool:
    """Whether this process uses the compiled gait."""
    return not robot_core.geometry.__file__.endswith(".py")


@cache
def check_fresh() -> None:
    """Check that a compiled gait in this process belongs to the current source.

    Raises:
        NaoGaitError: It was compiled from other sources.
    """
    folder = Path(robot_core.__file__).resolve().parents[1]
    made_of = folder / MADE_OF
    if made_of.is_file() and made_of.read_text(encoding="utf-8").split()[0] != sources(SOURCE):
        raise NaoGaitError(
            "compiled gait", str(folder), f"one of {SOURCE} as it is now: run nao_gait compile"
        )


def sources(folder: Path) -> str:
    """A hash of all modules of the packages in a folder."""
    whole = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((folder / package).rglob("*.py")):
            whole.update(f"{path.relative_to(folder)} {path.stat().st_size}\n".encode())
            whole.update(path.read_bytes())
    return whole.hexdigest()
