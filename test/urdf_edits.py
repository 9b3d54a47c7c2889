"""The URDF of the shipped NAO with something changed."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

from robot_core.resources import find

Xml = Callable[[ET.Element], None]
"""An edit of the tree of a URDF."""


def joint(root: ET.Element, name: str) -> ET.Element:
    """The element of a joint."""
    element = root.find(f"joint[@name='{name}']")
    assert element is not None
    return element


def edited_urdf(folder: Path, edit: Xml, name: str = "edited.urdf") -> Path:
    """Write the edited URDF of the shipped NAO; its path."""
    root = ET.fromstring(find("urdf", "nao_h21_v33").read_text())
    edit(root)
    path = folder / name
    path.write_text(ET.tostring(root, encoding="unicode"))
    return path


def without_joint(name: str) -> Xml:
    """Remove a joint."""
    return lambda root: root.remove(joint(root, name))


def without_link(name: str) -> Xml:
    """Remove a link."""

    def edit(root: ET.Element) -> None:
        for link in root.findall(f"link[@name='{name}']"):
            root.remove(link)

    return edit


def with_limit(name: str, **values: str | None) -> Xml:
    """Change attributes of a joint's limit; None removes one."""

    def edit(root: ET.Element) -> None:
        limit = joint(root, name).find("limit")
        assert limit is not None
        for key, value in values.items():
            if value is None:
                del limit.attrib[key]
            else:
                limit.set(key, value)

    return edit


def without_limit(name: str) -> Xml:
    """Remove the limit of a joint."""

    def edit(root: ET.Element) -> None:
        element = joint(root, name)
        limit = element.find("limit")
        assert limit is not None
        element.remove(limit)

    return edit


def rehung(name: str, parent: str) -> Xml:
    """Give a joint another parent link."""

    def edit(root: ET.Element) -> None:
        element = joint(root, name).find("parent")
        assert element is not None
        element.set("link", parent)

    return edit
