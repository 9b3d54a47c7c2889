"""Published figures, shown beside our own. Nothing in here was measured by this package.

The paper: Graf and Roefer, a real NAO. `placo`: the open-loop walk of placo 0.10.2 on a plant much
like `reference` (nine robots, heading held, motors twice as strong as the URDF's effort).
`NAO`: the fastest forward walk that was measured on real NAO hardware (Nao Devils 2017-19).
"""

from collections.abc import Mapping

PAPER_SPEED: Mapping[str, float] = {"forward": 31.0, "back": 22.0, "side": 12.0, "turn": 92.0}
"""Top speeds [cm/s, deg/s]."""
PLACO_SPEED: Mapping[str, tuple[float, float]] = {
    "forward": (29.0, 31.0), "back": (33.0, 35.0), "side": (15.0, 16.0), "turn": (77.0, 86.0),
}  # fmt: skip
"""Slowest and fastest robot; back: of the eight of nine robots that stayed upright."""
NAO_SPEED: Mapping[str, float] = {"forward": 35.0}

PAPER_COM_ERROR: Mapping[str, float] = {"spot": 4.26, "forward_10": 5.88, "forward": 7.76}
"""Mean |CoM y error|, expected against measured [mm]; `forward` is the top speed."""

PLACO_PUSH: Mapping[str, float] = {"left": 1.75, "right": 1.75, "forward": 2.0, "back": 2.0}
"""Largest impulse [N s] that one robot survived in all of six phases, stepping on the spot."""
PUBLISHED_NOTE = (
    "paper: Graf and Röfer on a real NAO. placo: the open-loop walk of placo 0.10.2 on a plant "
    "much like reference, nine robots with stronger motors, heading held. NAO: the fastest forward "
    "walk measured on NAO hardware (Nao Devils, 2017-19). These three were not measured here."
)


def placo_speed(task: str) -> str:
    """The cell of a task: slowest to fastest robot."""
    if task not in PLACO_SPEED:
        return ""
    low, high = PLACO_SPEED[task]
    return f"{low:.0f}-{high:.0f}"


def speed_cell(speeds: Mapping[str, float], task: str) -> str:
    """The cell of a task; empty where nothing is published."""
    return f"{speeds[task]:.0f}" if task in speeds else ""
