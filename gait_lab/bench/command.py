"""The command line that runs a suite again with the same options."""

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from sim_bridge.plant import option_text

_SINGLE = {
    "robots": "--robots", "seed": "--seed", "engine": "--engine", "plant": "--plant",
    "urdf": "--urdf", "window": "--seconds", "open_loop": "--open-loop", "phases": "--phases",
    "metres": "--metres", "attempts": "--attempts", "changes": "--changes", "runs": "--runs",
    "loss": "--loss", "ticks": "--ticks", "minutes": "--minutes",
    "placo_python": "--placo-python",
}  # fmt: skip
_REPEATED = {
    "tasks": "--task", "ingredients": "--ingredient", "impulses": "--impulse",
    "directions": "--direction",
    "experiments": "--experiment", "faults": "--fault", "plant_options": "--plant-set",
}  # fmt: skip
_ALWAYS = {"seed": 0, "plant": "reference"}
"""Defaults of the command line that no suite changes."""


def flag_of(option: str) -> str:
    """The option of the command line for an option of `BenchOptions`."""
    flags = {**_SINGLE, **_REPEATED, "half_speed": "--no-half", "jobs": "--jobs", "show": "show"}
    return flags[option]


def command_line(
    suite: str, given: Mapping[str, Any], preset: str = "default", settings: Sequence[str] = ()
) -> str:
    """`nao_gait bench ...` for these options of `BenchOptions`; how many processes is left out."""
    words = ["nao_gait", "bench", suite]
    for name, flag in _SINGLE.items():
        if name in given and given[name] != _ALWAYS.get(name):
            words += [flag, _text(given[name])]
    for name, flag in _REPEATED.items():
        for each in given.get(name, ()):
            words += [flag, option_text(each) if name == "plant_options" else _text(each)]
    if given.get("half_speed") is False:
        words.append("--no-half")
    if preset != "default":
        words += ["--preset", preset]
    for setting in settings:
        words += ["--set", setting]
    return shlex.join(words)


def _text(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)
