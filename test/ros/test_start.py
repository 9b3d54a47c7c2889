"""Each node starts, and one that is still starting ends quietly on Ctrl-C."""

import os
import signal
import subprocess
import sys

import pytest

from ros_probe import MODULES, ROOT, TIMEOUT

INTERRUPTED = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from {module} import main

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {interrupted!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
sys.exit(main([{module!r}]))
"""


@pytest.mark.parametrize("name", ["gait", "sim_bridge"])
@pytest.mark.parametrize("interrupted", ["robot_core.ros.process", "numpy", "rclpy"])
def test_ctrl_c_during_the_imports_prints_nothing(name: str, interrupted: str) -> None:
    program = INTERRUPTED.format(module=MODULES[name], interrupted=interrupted)
    ended = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT, env=dict(os.environ), capture_output=True, text=True, timeout=TIMEOUT,
    )  # fmt: skip
    handled = interrupted != "robot_core.ros.process"  # which has the handlers
    assert ended.returncode == (0 if handled else -signal.SIGINT)
    assert ended.stdout + ended.stderr == ""


@pytest.mark.parametrize("name", MODULES)
def test_each_starts_by_itself(name: str) -> None:
    """In other tests it finds what `node_server.py` has imported."""
    started = subprocess.run(
        [sys.executable, "-m", MODULES[name], "--help"],
        cwd=ROOT, capture_output=True, text=True, timeout=TIMEOUT,
    )  # fmt: skip
    assert (started.returncode, started.stderr) == (0, "")
    assert started.stdout.startswith(f"usage: {name} ")
