"""Published figures, shown beside our own. Nothing in here was measured by this package.

The paper: Graf and Roefer, a real NAO. placo: the open-loop walk of placo 0.10.2 on a plant much
like `reference` (nine robots, heading held, motors twice as strong as the URDF's effort). NAO: the
fastest forward walk that was measured on NAO hardware (Nao Devils 2017-19).
"""

from collections.abc import Mapping

PAPER_SPEED: Mapping[str, float] = {"forward": 31.0, "back": 22.0, "side": 12.0, "turn": 92.0}
"""Top speeds [cm/s, deg/s]."""
PLACO_SPEED: Mapping[str, str] = {
    "forward": "29-31", "back": "33-35", "side": "15-16", "turn": "77-86",
}  # fmt: skip
"""Slowest and fastest robot; back: of the eight of nine robots that stayed upright."""
NAO_SPEED: Mapping[str, str] = {"forward": "35"}
PAPER_COM_ERROR: Mapping[str, float] = {"spot": 4.26, "forward_10": 5.88, "forward": 7.76}
"""Mean |CoM y error|, expected against measured [mm]; `forward` is the top speed."""
PLACO_PUSH: Mapping[str, float] = {"left": 1.75, "right": 1.75, "forward": 2.0, "back": 2.0}
"""Largest impulse [N s] that one robot survived in all of six phases, stepping on the spot."""
