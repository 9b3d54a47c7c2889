"""Named changes of the gait's parameters, from a YAML file (`config/bench/ablation.yaml`)."""

from pathlib import Path
from typing import Any

import attrs

from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.schema import Anything, Settings, Table

UNCHANGED = "unchanged"
"""Name of the gait without a change."""


@attrs.frozen
class Change(Settings):
    """One entry of the file: another preset, other values of parameters, or both."""

    name: str = schema.field(schema.NAME)
    preset: str | None = schema.field(schema.Text(), None, "None = that of the bench.")
    set: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))

    @property
    def settings(self) -> dict[str, Any]:
        """The changed values by parameter."""
        return self.set

    def parameters(self, base: GaitParameters) -> GaitParameters:
        """The changed parameters of the gait."""
        start = base if self.preset is None else load_preset(self.preset)
        return start.replace(**self.set)


def load_changes(path: Path | None = None) -> tuple[Change, ...]:
    """Load the changes of a file, or the shipped ones; NaoGaitError for a bad entry."""
    path = share("config", "bench", "ablation.yaml") if path is None else path
    where = f"ablation {path}"
    entries = schema.read_yaml(path, "ablation")
    if not isinstance(entries, dict) or not entries:
        raise NaoGaitError(where, entries, "a mapping of names to changes")
    changes = []
    for name, entry in entries.items():
        path_of = f"{where}: {name}"
        if not isinstance(entry, dict) or not entry:
            raise NaoGaitError(path_of, entry, "a mapping with preset, set or both")
        if name == UNCHANGED or not schema.is_name(str(name)):
            raise NaoGaitError(path_of, name, f"{schema.NAME.description}, not {UNCHANGED}")
        change = Change.from_mapping({**entry, "name": name}, path_of)
        GaitParameters.checked(change.set, f"{path_of}.set", partial=True)
        change.parameters(GaitParameters())  # an unknown preset
        changes.append(change)
    return tuple(changes)
