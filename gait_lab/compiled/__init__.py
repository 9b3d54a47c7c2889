"""The gait as machine code: the same source through mypyc, bit for bit the same walk."""

from pathlib import Path

import gait_lab
import nao_lipm_gait
from nao_lipm_gait.errors import NaoGaitError

SOURCE = Path(gait_lab.__file__).resolve().parents[1] / "nao_lipm_gait"
"""The package that lies beside this one: what is compiled."""


def is_compiled() -> bool:
    """Whether this process walks with the compiled gait."""
    import nao_lipm_gait.gait

    return not nao_lipm_gait.gait.__file__.endswith(".py")


def check_fresh() -> None:
    """NaoGaitError if this process walks with a gait that was compiled from other sources."""
    used = Path(nao_lipm_gait.__file__).resolve().parent
    if used == SOURCE or not any(used.glob("*.so")):
        return
    if _sources(used) != _sources(SOURCE):
        raise NaoGaitError(
            "compiled gait", str(used.parent), f"one of {SOURCE} as it is now: nao_gait compile"
        )


def _sources(package: Path) -> dict[Path, bytes]:
    return {path.relative_to(package): path.read_bytes() for path in package.rglob("*.py")}
