"""A ROS of another Python on the path, as after `source /opt/ros/...`: one line that names it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ros_probe import MODULES, ROOT

BROKEN = {
    "rclpy/__init__.py": "import _rclpy_pybind11_of_another_python",
    "std_msgs/msg/__init__.py": 'raise ImportError("libpython3.10.so.1.0: cannot open it")',
}


@pytest.mark.parametrize("broken", BROKEN)
@pytest.mark.parametrize(
    "command", [[MODULES["gait"]], [MODULES["sim_bridge"]], ["gait_lab.cli", "record", "bag"]]
)
def test_a_ros_of_another_python_is_named(tmp_path: Path, broken: str, command: list[str]) -> None:
    file = tmp_path / "ros" / broken
    file.parent.mkdir(parents=True)
    for folder in file.parents[:-1]:
        if folder.is_relative_to(tmp_path / "ros" / broken.split("/")[0]):
            (folder / "__init__.py").touch()
    file.write_text(BROKEN[broken])
    path = os.pathsep.join((str(tmp_path / "ros"), str(ROOT)))
    done = subprocess.run(
        [sys.executable, "-m", *command], env=os.environ | {"PYTHONPATH": path}, cwd=tmp_path,
        capture_output=True, text=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode in (1, 2)
    line, *more = done.stderr.splitlines()
    assert more == []
    assert "cannot import: " in line
    assert f"PYTHONPATH has {tmp_path / 'ros'}: a ROS of another Python?" in line
