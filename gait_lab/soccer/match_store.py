"""Finished matches in a file, so that many of them can be played in several goes.

One line of JSON for each match: what it was, and what came of it. Lines are only added, so several
processes may write. The file does not know the code: begin a new one when behaviour has changed.
"""

import json
import math
import os
from pathlib import Path
from typing import Any

from gait_lab.soccer.match import MatchResult, MatchSpec, play_match
from nao_lipm_gait.errors import NaoGaitError
from nao_soccer.referee.rules import Goal


def play_or_recall(spec: MatchSpec, file: str) -> MatchResult:
    """Play a match and keep its result, or take it from the file.

    Args:
        spec: The match; a replay is not kept.
        file: Path of the file; it need not exist.

    Raises:
        NaoGaitError: The file cannot be used, or the match cannot be played.
    """
    path = Path(file)
    for line in _lines(path):
        if line.get("match") == _key(spec):
            return _result(spec, line, file)
    result = play_match(spec)
    text = json.dumps(
        {
            "match": _key(spec),
            "goals": [list(goal) for goal in result.goals],
            "score": result.score,
            "seconds": result.seconds,
            "falls": result.falls,
            "kicks": result.kicks,
            "strokes": result.strokes,
            "messages": result.messages,
            "one_striker": None if math.isnan(result.one_striker) else result.one_striker,
            "conflict": None if math.isnan(result.conflict) else result.conflict,
            "wrong_half": result.wrong_half,
        }
    )
    try:
        with path.open("ab", buffering=0) as out:  # one write: lines of two processes do not mix
            out.write(text.encode() + os.linesep.encode())
    except OSError as error:
        raise NaoGaitError("keep", file, f"a file that can be written ({error})") from error
    return result


def _key(spec: MatchSpec) -> str:
    """What a match depends on, but its replay."""
    names = (name for name in MatchSpec.__slots__ if name != "frames")
    return ", ".join(f"{name}={getattr(spec, name)!r}" for name in names)


def _lines(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    try:
        found = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        if not all(isinstance(line, dict) for line in found):
            raise ValueError("a line is no object")
    except (OSError, ValueError) as error:
        raise NaoGaitError("keep", str(path), f"a file of finished matches ({error})") from error
    return found


def _result(spec: MatchSpec, line: dict[str, Any], file: str) -> MatchResult:
    try:
        one, conflict = (
            math.nan if line[name] is None else float(line[name])
            for name in ("one_striker", "conflict")
        )
        return MatchResult(
            spec, line["score"], [Goal(*goal) for goal in line["goals"]], line["seconds"],
            line["falls"], line["kicks"], line["strokes"], line["messages"], one, conflict,
            line["wrong_half"],
        )  # fmt: skip
    except (KeyError, TypeError) as error:
        allowed = f"lines of finished matches; that of seed {spec.seed} lacks something: {error}"
        raise NaoGaitError("keep", file, allowed) from error
