"""Ctrl-C and SIGTERM end a node quietly, with status 0, at any moment of its life."""

import os
import signal
from types import FrameType


class StopRequest:
    """Becomes true on SIGINT or SIGTERM. No rclpy in here: it is installed before the slow imports.

    Until `defer` is called there is nothing to tidy up, and a signal ends the process at once.
    """

    def __init__(self) -> None:
        self._requested = False
        self._deferred = False

    def __bool__(self) -> bool:
        return self._requested

    def install(self) -> None:
        signal.signal(signal.SIGINT, self._on_signal)
        signal.signal(signal.SIGTERM, self._on_signal)

    def defer(self) -> None:
        """From here on a signal only sets the flag; the loop of the node looks at it."""
        self._deferred = True

    def request(self) -> None:
        self._requested = True

    def _on_signal(self, _signum: int, _frame: FrameType | None) -> None:
        self._requested = True
        if not self._deferred:
            os._exit(0)  # an exception here would end in the imports as some ImportError
