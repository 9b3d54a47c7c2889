"""Reads the SROS2 policy that is shipped."""

import xml.etree.ElementTree as ET
from pathlib import Path

POLICY = Path(__file__).resolve().parents[1] / "config" / "sros2" / "policy.xml"


def rights(node: str) -> dict[tuple[str, str], set[str]]:
    """(topic or service, right) -> names, of a node in the policy."""
    root = ET.parse(POLICY).getroot()
    (profile,) = root.findall(f".//profile[@node='{node}']")
    found: dict[tuple[str, str], set[str]] = {}
    for group in profile:
        for right, word in group.attrib.items():
            assert word == "ALLOW"
            names = {(item.text or "").strip() for item in group}
            found[group.tag.removesuffix("s"), right] = names
    return found
