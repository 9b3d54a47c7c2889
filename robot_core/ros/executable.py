"""The `main` of an executable that is one node. Nothing heavy is imported here."""

import signal
from collections.abc import Callable, Sequence
from importlib import import_module


def executable(
    name: str, description: str, node: str, loop: str = "robot_core.ros.process:spin"
) -> Callable[..., int]:
    """The `main(args=None)` that runs a node until Ctrl-C or SIGTERM and returns the exit status.

    Args:
        name: Name of the executable, for its messages.
        description: For `--help`.
        node: `module:class` of the node.
        loop: `module:function` that serves the node until a stop is requested.
    """

    def main(args: Sequence[str] | None = None) -> int:
        # Before all other imports: Ctrl-C must end the process quietly from the start.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        from robot_core.ros.process import StopRequest, run

        stop = StopRequest()
        stop.install()
        return run(name, description, _loaded(node), _loaded(loop), args, stop)

    return main


def _loaded(place: str):  # type: ignore[no-untyped-def]
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
