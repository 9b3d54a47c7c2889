"""A text file, or the error that names it."""

from pathlib import Path

from nao_lipm_gait.errors import NaoGaitError


def read_text(path: Path, what: str) -> str:
    """what: kind of the file, for the error."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise NaoGaitError(f"{what} {path}", str(error), "a readable UTF-8 file") from error
