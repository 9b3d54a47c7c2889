"""Jobs for the tuner's processes, in a file that each of them imports at once."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gait_lab.tune.protocols import Measures
    from gait_lab.tune.study import Place, Study
    from nao_lipm_gait.parameters import GaitParameters


def square(number: int, dies: str) -> int:
    """A job that kills its process (3 once, 4 always), fails (5) or never ends (6)."""
    if number == 3 and dies and not Path(dies).exists():
        Path(dies).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 5:
        raise ValueError("no square")
    if number == 6:
        signal.pause()
    return number * number


def bowl(
    study: Study, parameters: GaitParameters, robots: tuple[int, ...], place: Place
) -> list[Measures]:
    """Instead of a walk: best in the middle of the ranges."""
    from gait_lab.tune.protocols import Measures

    off = (parameters.step_forward_max - 0.05) / 0.06, (parameters.swing_lift - 0.02) / 0.02
    return [Measures(robots[0], {"distance": -(off[0] ** 2) - off[1] ** 2}, fell=False)]


def kills_its_process_in_a_corner(
    study: Study, parameters: GaitParameters, robots: tuple[int, ...], place: Place
) -> list[Measures]:
    """A walk that takes its process with it where the stride is long."""
    if parameters.step_forward_max > 0.03:
        os.kill(os.getpid(), signal.SIGKILL)
    return bowl(study, parameters, robots, place)
