"""The `main` of an executable that is one node. Nothing heavy is imported here."""

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module


def executable(
    name: str, description: str, *nodes: str, loop: str = "robot_core.ros.process:spin"
) -> Callable[..., int]:
    """The `main(args=None)` that runs nodes until Ctrl-C or SIGTERM and returns the exit status.

    Args:
        name: Name of the executable, for its messages.
        description: For `--help`.
        nodes: `module:class` of each node.
        loop: `module:function` that serves them until a stop is requested.
    """

    def main(args: Sequence[str] | None = None) -> int:
        # Before all other imports: Ctrl-C must end the process quietly from the start.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        from robot_core.ros.process import StopRequest, run

        stop = StopRequest()
        stop.install()
        try:
            with no_collections():
                builds = [_loaded(node) for node in nodes]
            return run(name, description, builds, _loaded(loop), args, stop)
        except ImportError as error:
            print(f"{name}: {import_advice(error)}", file=sys.stderr)
            return 2

    return main


@contextmanager
def no_collections() -> Iterator[None]:
    """Start without Python's automatic collector: what a start makes stays, and is searched once.

    The node may switch the collector itself on or off meanwhile.
    """
    before = gc.get_threshold()
    gc.set_threshold(0)
    try:
        yield
    finally:
        gc.set_threshold(*before)


def import_advice(error: ImportError) -> str:
    """One line about a module that cannot be imported; a sourced ROS of another Python is named."""
    text = f"cannot import: {' '.join(str(error).split())}"
    folders = sourced_ros()
    if not folders:
        return text
    where = os.pathsep.join(folders)
    return f"{text}; PYTHONPATH has {where}: a ROS of another Python? Without it: env -u PYTHONPATH"


def sourced_ros() -> list[str]:
    """Folders of PYTHONPATH with packages of ROS, as a sourced setup.bash leaves them."""
    folders = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    return [
        each for each in folders
        if each and any(os.path.isdir(os.path.join(each, name)) for name in ("rclpy", "std_msgs"))
    ]  # fmt: skip


def _loaded(place: str):  # type: ignore[no-untyped-def]
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
