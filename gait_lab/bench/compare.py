"""`nao_gait fingerprint`: the hashes of the reference rollouts."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gait_lab.bench.fingerprint import ENGINES, Fingerprint, cases, fingerprints
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from robot_core.errors import NaoGaitError
from robot_core.schema import read_text

LARGEST = 4 * 1024 * 1024
"""[bytes] of an earlier output."""


def command(
    say: Callable[[str], None], *, engine: list[str] | None, compare: Path | None, jobs: int | None
) -> int:
    """Print the hashes, or compare them with an earlier output; the exit status."""
    engines = tuple(engine or ENGINES)
    before = None if compare is None else _read(compare)
    found = fingerprints(cases(engines), jobs)
    if before is None:
        json.dump(
            {key: each.as_list() for key, each in sorted(found.items())}, sys.stdout, indent=0
        )
        say("")
        return EXIT_OK
    changed = _changed(before, found, engines)
    for key in changed:
        similar = key in found and key in before and found[key].is_same_walk(before[key])
        cause = "another processor, or a small change of the walk"
        note = f" (but ends within 2 cm and 2 deg: {cause})" if similar else ""
        say(f"changed: {key}{note}")
    say(f"{len(found)} reference rollouts, {len(changed)} changed")
    return EXIT_FAILED if changed else EXIT_OK


def _read(file: Path) -> dict[str, list[Any]]:
    """Key -> digest and end pose of an earlier output; raises NaoGaitError."""
    try:
        content = json.loads(read_text(file, "fingerprints", LARGEST))
        return {key: [str(digest), *map(float, pose)] for key, (digest, *pose) in content.items()}
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        allowed = f"output of nao_gait fingerprint ({error})"
        raise NaoGaitError("compare", str(file), allowed) from error


def _changed(
    before: Mapping[str, Sequence[Any]], found: Mapping[str, Fingerprint], engines: Sequence[str]
) -> list[str]:
    """Keys in these engines that are gone or have another digest; new ones were not there."""
    wanted = sorted(key for key in before if key.split("/")[0] in engines)
    return [key for key in wanted if key not in found or before[key][0] != found[key].digest]
