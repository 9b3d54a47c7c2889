"""Which code, which method, which seed: what makes a result repeatable."""

import subprocess
from pathlib import Path
from xml.etree import ElementTree

from nao_lipm_gait.resources import share


def code_version() -> str:
    """Version of the package, with the commit where it runs from a checkout."""
    released = ElementTree.parse(share("package.xml")).findtext("version") or "unknown"
    commit = _commit(Path(__file__).resolve().parents[2])
    return f"{released}, commit {commit}" if commit else released


def _commit(root: Path) -> str | None:
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() or None
