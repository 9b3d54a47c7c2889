"""Finished runs in a file, so that a long series can be done in several goes.

One line of JSON for each run: the hash of what it depends on, and what came of it. Lines are only
added, so files of several machines can be joined. The file does not know the code: begin a new one
when behaviour has changed.
"""

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from robot_core.errors import NaoGaitError
from robot_core.schema import read_text, require_writable

_KEY = "run"
LARGEST = 256 * 1024 * 1024
"""[bytes] of a file of finished runs."""


class ResultCache:
    """The file of finished runs.

    Args:
        path: The file; it need not exist.
        restore: Makes the result of a run, `restore(item, **values)`. The values are the fields of
            the result but its first, which is the run itself, as JSON keeps them; lists as tuples,
            dataclasses as mappings.

    Raises:
        NaoGaitError: The file cannot be read or written.
    """

    def __init__(self, path: str, restore: Callable[..., Any]) -> None:
        self._path = Path(path)
        self._restore = restore
        self._lines: dict[str, Mapping[str, Any]] = {}
        require_writable(self._path, "resume")
        if not self._path.exists():
            return
        try:
            for line in read_text(self._path, "results", LARGEST).splitlines():
                values = json.loads(line)
                key = values.pop(_KEY)
                self._lines[key] = {
                    name: tuple(each) if isinstance(each, list) else each
                    for name, each in values.items()
                }
        except (ValueError, AttributeError, KeyError, TypeError, RecursionError) as error:
            allowed = f"a file of finished runs ({type(error).__name__}: {error})"
            raise NaoGaitError("resume", path, allowed) from error

    def result(self, item: Any) -> Any:
        """The result of a run; None if it is not finished. Raises NaoGaitError."""
        values = self._lines.get(_key(item))
        if values is None:
            return None
        try:
            return self._restore(item, **values)
        except TypeError as error:
            allowed = f"a file of finished runs like the ones asked for ({error})"
            raise NaoGaitError("resume", str(self._path), allowed) from error

    def add(self, item: Any, result: Any) -> None:
        """Write the result of a run, a dataclass whose first field is the run itself.

        Raises:
            NaoGaitError: The file cannot be written.
        """
        values = {each.name: getattr(result, each.name) for each in fields(result)[1:]}
        text = json.dumps({_KEY: _key(item), **values}, default=asdict)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab", buffering=0) as out:  # one write: lines do not mix
                out.write(text.encode() + os.linesep.encode())
        except OSError as error:
            raise NaoGaitError(
                "resume", str(self._path), f"a file that can be written ({error})"
            ) from error


def _key(item: Any) -> str:
    return hashlib.sha256(repr(item).encode()).hexdigest()[:16]
