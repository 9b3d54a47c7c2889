"""MuJoCo is optional: everything runs on PyBullet, and a refusal says how to install MuJoCo."""

import re
import subprocess
import sys

from sim_bridge.engines import registry as engines

WITHOUT = """
import sys
sys.modules["mujoco"] = None  # as if it were not installed: imports fail, searches find nothing
from gait_lab.cli import main
from sim_bridge.trials import tasks
tasks.RAMP_TIME = tasks.SETTLE_TIME = 0.5
sys.exit(main(sys.argv[1:]))
"""


def nao_gait(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", WITHOUT, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)


def test_rollouts_run_on_pybullet() -> None:
    done = nao_gait(
        "bench", "speed", "--robots", "1", "--jobs", "1", "--seconds", "0.5",
        "--task", "forward=10", "--open-loop", "off", "--no-half", "--engine", "pybullet",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert re.search(r"upright \[robots\]\s+1\n", done.stdout)
    assert "pybullet" in done.stdout


def test_asking_for_mujoco_says_what_to_install() -> None:
    done = nao_gait("bench", "compute", "--engine", "mujoco", "--seconds", "1")
    assert done.returncode != 0
    assert "pip install 'mujoco>=4,<5'" in done.stderr
    assert "Traceback" not in done.stderr


def test_installed_finds_nothing_that_cannot_be_imported() -> None:
    code = (
        'import sys; sys.modules["mujoco"] = None; '
        "from sim_bridge.engines.registry import installed; "
        'print(installed("mujoco"), installed("pybullet"))'
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.split() == ["False", str(engines.installed("pybullet"))]
