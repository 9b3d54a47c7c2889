"""Named changes of the gait's parameters, as lists in YAML (`config/bench/ablation.yaml`)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_lipm_gait.resources import share

UNCHANGED = "unchanged"
"""The name of what nobody changed."""
_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True, slots=True)
class Change:
    """One entry of the list."""

    name: str
    preset: str | None
    """None = what the bench runs on."""
    settings: Mapping[str, Any]

    def parameters(self, base: GaitParameters) -> GaitParameters:
        start = base if self.preset is None else load_preset(self.preset)
        return start.replace(**self.settings)


def load_changes(path: Path | None = None) -> tuple[Change, ...]:
    """The list of a YAML file; None = the shipped one. NaoGaitError says what is wrong with it."""
    path = share("config", "bench", "ablation.yaml") if path is None else path
    try:
        entries = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise NaoGaitError(f"ablation {path}", reason, "a readable YAML file") from error
    if not isinstance(entries, dict) or not entries:
        raise NaoGaitError(f"ablation {path}", entries, "a mapping of names to changes")
    return tuple(_change(path, name, entry) for name, entry in entries.items())


def _change(path: Path, name: Any, entry: Any) -> Change:
    where = f"ablation {path}: {name}"
    if not isinstance(name, str) or not _NAME.fullmatch(name) or name == UNCHANGED:
        raise NaoGaitError(f"ablation {path}", name, "names of small letters, digits and _")
    if not isinstance(entry, dict) or not entry or set(entry) - {"preset", "set"}:
        raise NaoGaitError(where, entry, "a mapping with preset, set or both")
    preset, settings = entry.get("preset"), entry.get("set", {})
    if preset is not None and not isinstance(preset, str):
        raise NaoGaitError(f"{where}: preset", preset, "the name of a preset or a file")
    if not isinstance(settings, dict):
        raise NaoGaitError(f"{where}: set", settings, "a mapping of parameters")
    change = Change(name, preset, settings)
    change.parameters(GaitParameters())  # unknown parameters and bad values
    return change
