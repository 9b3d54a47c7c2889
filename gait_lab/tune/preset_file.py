"""The winner as a gait preset: a YAML file that every tool here takes with --preset."""

from collections.abc import Mapping
from pathlib import Path

import yaml

from nao_lipm_gait.parameters import BY_NAME, GaitParameters


def write_preset(
    path: Path, parameters: GaitParameters, varied: Mapping[str, float], lines: list[str]
) -> Path:
    """Write all parameters, those that the study varied first; `lines` become the comments.

    All, because the defaults of what is not written may change, and the result with them.
    """
    values = parameters.as_dict()
    rest = [name for name in values if name not in varied]
    text = "".join(f"# {line}".rstrip() + "\n" for line in lines)
    for title, names in (("tuned", list(varied)), ("as they were", rest)):
        text += f"\n# -- {title}\n"
        for name in names:
            value = values[name]
            written = value if isinstance(value, bool | str) else round(value, 7)
            unit = f" # [{BY_NAME[name].unit}]" if BY_NAME[name].unit else ""
            text += yaml.safe_dump({name: written}).strip() + unit + "\n"
    path.write_text(text, encoding="utf-8")
    return path
