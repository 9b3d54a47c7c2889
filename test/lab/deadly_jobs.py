"""Jobs for the tuner's processes, in a file that each of them imports at once."""

import os
import signal
from pathlib import Path


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
