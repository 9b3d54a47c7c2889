"""Finds the shipped files (config, urdf, launch) in any kind of installation."""

import os
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from robot_core.errors import NaoGaitError
from robot_core.schema import read_yaml

PACKAGE = "nao_lipm_gait"
_MARKER = Path("config", "gait", "default.yaml")
"""A folder is accepted only if it holds this file."""

_KINDS = {
    "urdf": (("urdf",), (".urdf", ".xml")),
    "plants": (("config", "plants"), (".yaml", ".yml")),
    "gait": (("config", "gait"), (".yaml", ".yml")),
    "robots": (("config", "robots"), (".yaml", ".yml")),
    "scenes": (("config", "scenes"), (".yaml", ".yml")),
    "vision": (("config", "vision"), (".yaml", ".yml")),
    "kicks": (("config", "kicks"), (".yaml", ".yml")),
    "studies": (("config", "studies"), (".yaml", ".yml")),
}
_FILES = {"urdf": "URDF, MJCF or robot file"}
"""What a path may lead to, where a suffix does not say it."""
_FIELDS = {"urdf": "robot", "gait": "preset", "vision": "colors", "studies": "study"}
"""What users call a kind; the others are the singular of its key."""


def _candidates(module: Path, prefixes: tuple[Path, ...]) -> Iterator[Path]:
    """Folders that may hold the shared files of a package, nearest first; `module` is in it.

    A checkout keeps them beside the package folder. A wheel, a user install and a colcon install
    all keep them in `share/` of some folder above it.
    """
    # In a colcon symlink install the modules are links: search at both ends.
    for start in dict.fromkeys((module.absolute(), module.resolve())):
        yield start.parents[1]
        for parent in start.parents[1:]:
            yield parent / "share" / PACKAGE
    for prefix in prefixes:
        yield prefix / "share" / PACKAGE


def _ament_prefixes() -> tuple[Path, ...]:
    try:
        from ament_index_python.packages import (  # missing in a plain pip install
            PackageNotFoundError,
            get_package_prefix,
        )
    except ImportError:
        return ()
    try:
        return (Path(get_package_prefix(PACKAGE)),)
    except (PackageNotFoundError, LookupError, ValueError, OSError):
        return ()


def _locate(module: Path, prefixes: tuple[Path, ...]) -> Path:
    candidates = tuple(dict.fromkeys(_candidates(module, prefixes)))
    for candidate in candidates:
        if (candidate / _MARKER).is_file():
            return candidate
    searched = ", ".join(str(candidate) for candidate in candidates)
    raise NaoGaitError("shared files", "not found", f"{_MARKER} in one of: {searched}")


@cache
def _root() -> Path:
    return _locate(Path(__file__), (*_ament_prefixes(), Path(sys.prefix)))


def share(*parts: str) -> Path:
    """The path of a shipped file or folder: `share("launch", "walk.launch.py")`.

    Raises NaoGaitError if it does not exist.
    """
    path = _root().joinpath(*parts)
    if not path.exists():
        raise NaoGaitError("shared file", str(path), "a file or folder that was installed")
    return path


def names(kind: str) -> tuple[str, ...]:
    """The shipped names of a kind, which is a key of `_KINDS`.

    Raises:
        NaoGaitError: There is no such kind.
    """
    if kind not in _KINDS:
        raise NaoGaitError("kind of resource", kind, _KINDS)
    folder, suffixes = _KINDS[kind]
    found = _root().joinpath(*folder).glob(f"*{suffixes[0]}")
    return tuple(sorted(path.stem for path in found))


def find(kind: str, name_or_path: str | Path) -> Path:
    """Find the file of a shipped name (`find("plants", "reference")`) or of a path.

    A shipped name wins over a file of the same name in the working directory; write `./name` for
    the latter. Raises NaoGaitError that lists the shipped names.
    """
    shipped = names(kind)
    folder, suffixes = _KINDS[kind]
    text, field = str(name_or_path), _FIELDS.get(kind, kind.removesuffix("s"))
    if text in shipped:
        return share(*folder, f"{text}{suffixes[0]}")
    path_of = _FILES.get(kind, f"{suffixes[0]} file")
    allowed = f"a shipped name ({', '.join(shipped) or 'none'}) or the path of a {path_of}"
    looks_like_path = "/" in text or "\\" in text or text.lower().endswith(suffixes)
    try:
        path = Path(text).expanduser()
        is_file = bool(text) and path.is_file()
    except (OSError, ValueError, RuntimeError) as error:  # null bytes, names too long, no home
        raise NaoGaitError(field, text, allowed, shipped) from error
    if is_file:
        return path
    if looks_like_path:
        raise NaoGaitError(f"{field} file", text, f"a file that exists; or {allowed}")
    raise NaoGaitError(field, text, allowed, shipped)


def read_layers(
    path: Path, what: str, kind: str | None = None, above: tuple[Path, ...] = ()
) -> tuple[tuple[Path, dict[str, Any]], ...]:
    """Read a YAML file and those that its key `base` names; each holds what differs from the next.

    Args:
        path: The file.
        what: What the file is, for error messages.
        kind: Shipped names of this kind can be a base; a file beside this one always can.
        above: Files that are based on this one.

    Returns:
        Path and mapping of each file, the lowest base first.

    Raises:
        NaoGaitError: A file that cannot be read, no mapping, an unknown base, a circle of bases.
    """
    values = read_yaml(path, what)
    if values is None:
        values = {}
    if not isinstance(values, dict):
        raise NaoGaitError(f"{what} {path}", values, "a mapping of keys")
    if "base" not in values:
        return ((path, values),)
    base, where = values.pop("base"), f"{what} {path}: base"
    shipped = names(kind) if kind else ()
    if kind and base in shipped:
        found = find(kind, base)
    else:
        suffix = "" if str(base).endswith((".yaml", ".yml")) else ".yaml"
        found = path.parent / f"{base}{suffix}"
        if not isinstance(base, str) or not os.path.isfile(found):
            allowed = f"a {what} beside it (YAML)"
            if shipped:
                allowed = f"one of {', '.join(shipped)}; or {allowed}"
            raise NaoGaitError(where, base, allowed, shipped)
    if found.resolve() in (*above, path.resolve()):
        raise NaoGaitError(where, base, f"a {what} that is not based on this one")
    return (*read_layers(found, what, kind, (*above, path.resolve())), (path, values))
