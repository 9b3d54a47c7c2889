"""The compiled gait: the same source through mypyc, which gives the same walk to the bit."""

import hashlib
from functools import cache
from pathlib import Path

import gait_lab
import nao_lipm_gait
from robot_core.errors import NaoGaitError

SOURCE = Path(gait_lab.__file__).resolve().parents[1] / "nao_lipm_gait"
"""The package beside this one, which is compiled."""
MADE_OF = "made_of.txt"
"""File in the folder of a compiled gait that names its source; it begins with a hash of it."""


def is_compiled() -> bool:
    """Whether this process uses the compiled gait."""
    import nao_lipm_gait.gait

    return not nao_lipm_gait.gait.__file__.endswith(".py")


@cache
def check_fresh() -> None:
    """Check that a compiled gait in this process belongs to the current source.

    Raises:
        NaoGaitError: It was compiled from other sources.
    """
    folder = Path(nao_lipm_gait.__file__).resolve().parents[1]
    made_of = folder / MADE_OF
    if made_of.is_file() and made_of.read_text(encoding="utf-8").split()[0] != sources(SOURCE):
        raise NaoGaitError(
            "compiled gait", str(folder), f"one of {SOURCE} as it is now: run nao_gait compile"
        )


def sources(package: Path) -> str:
    """A hash of all modules of a package."""
    whole = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        whole.update(f"{path.relative_to(package)} {path.stat().st_size}\n".encode())
        whole.update(path.read_bytes())
    return whole.hexdigest()
