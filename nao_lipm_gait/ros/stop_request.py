"""Ctrl-C and SIGTERM end a node quietly, with status 0, at any moment of its life."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
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


@contextmanager
def stop_on_signal() -> Iterator[StopRequest]:
    """For the loop of a tool: inside, a signal only sets the flag; before and after, as it was.

    KeyboardInterrupt in the middle of rclpy comes out as any error (`take_message` makes it a
    RuntimeError); so rclpy must be initialised with SignalHandlerOptions.NO beside this.
    """
    stop = StopRequest()
    stop.defer()
    if threading.current_thread() is not threading.main_thread():
        yield stop  # signals go to the main thread, whoever that belongs to
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    stop.install()
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
