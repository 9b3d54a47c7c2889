"""placo's walk on our plant: its joint trajectories are planned in another process.

placo (Rhoban, on PyPI) pins a version of Pinocchio that conflicts with ours, so it runs in another
Python environment. It plans for the same URDF and the same command over time, without the errors of
the individual robot, and is played open loop, as in its own example.
"""

import json
import subprocess
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.peers.player import JointPlan, PeerPlayback
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from sim_bridge.trials.tasks import STAND_TIME, Task

PROCESS = Path(__file__).with_name("placo_process.py")
HOW_TO_GET_IT = "python3 -m venv placo-env && placo-env/bin/pip install placo==0.10.2"
TIME_LIMIT = 300.0
"""[s] after which a plan is given up; it takes about one."""
REPLAN = 0.1
"""[s] between two plans of the footsteps."""
SOLE_WIDTH = 0.07
"""[m] Less than the real sole. placo keeps soles of this width apart with a margin of its own; with
the real width it would shorten every step of a NAO."""
WALK: Mapping[str, float] = {
    "single_support_duration": 0.20,
    "single_support_timesteps": 14,
    "double_support_ratio": 0.0,
    "startend_double_support_ratio": 1.5,
    "planned_timesteps": 48,
    "walk_com_height": 0.255,
    "walk_foot_height": 0.025,
    "walk_trunk_pitch": 0.05,
    "walk_foot_rise_ratio": 0.3,
    "foot_width": SOLE_WIDTH,
    "feet_spacing": 0.122,
    "zmp_margin": 0.02,
    "foot_zmp_target_x": 0.0,
    "foot_zmp_target_y": 0.0,
    "walk_max_dx_forward": 0.12,
    "walk_max_dx_backward": 0.12,
    "walk_max_dy": 0.06,
    "walk_max_dtheta": 0.6,
}
"""The parameters with which placo walked best on a NAO; those of its example are for a robot of
7 kg."""


@dataclass(frozen=True, slots=True)
class Placo:
    """Makes players of placo's walk; small and picklable.

    Attributes:
        python: Python of the environment with placo.
    """

    python: str

    def __call__(self, robot: RobotDescription, task: Task, period: float) -> PeerPlayback:
        """A player for a robot and a task; `period` of the control ticks in s."""
        knots = tuple((t, c.x, c.y, c.yaw) for t, c in task.knots)
        plan = _planned(self.python, robot, knots, float(np.ceil(task.end)), period)
        return PeerPlayback(robot, plan, period)

    def check(self) -> None:
        """Raise NaoGaitError unless this Python runs and has placo."""
        try:
            done = subprocess.run(
                [self.python, "-I", "-c", "import placo"],
                capture_output=True, text=True, timeout=TIME_LIMIT, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise NaoGaitError("placo-python", self.python, f"a Python ({error})") from error
        if done.returncode:
            raise NaoGaitError(
                "placo-python", self.python, f"a Python with placo ({_last_line(done.stderr)}); "
                f"to make one: {HOW_TO_GET_IT}",
            )  # fmt: skip


@lru_cache(maxsize=64)
def _planned(
    python: str,
    robot: RobotDescription,
    knots: tuple[tuple[float, float, float, float], ...],
    end: float,
    period: float,
) -> JointPlan:
    with tempfile.TemporaryDirectory(prefix="nao_gait_placo_") as folder:
        asked, answered = Path(folder, "request.json"), Path(folder, "answer.npz")
        asked.write_text(json.dumps(request(robot, knots, end, period)), encoding="utf-8")
        command = [python, "-I", str(PROCESS), str(asked), str(answered)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=TIME_LIMIT, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise NaoGaitError(
                "placo-python", python, f"a Python that returns a plan ({error})"
            ) from error
        if done.returncode or not answered.is_file():
            reason = _last_line(done.stderr) or f"exit status {done.returncode}"
            raise NaoGaitError(
                "placo-python", python, f"a Python whose placo can plan the walk ({reason})"
            )
        with np.load(answered) as answer:
            return JointPlan(answer["joints"], answer["support"], answer["com"])


def request(
    robot: RobotDescription,
    knots: tuple[tuple[float, float, float, float], ...],
    end: float,
    period: float,
) -> dict[str, Any]:
    """The input of `placo_process.py`.

    Args:
        robot: Its URDF and joints.
        knots: Times [s] with commands x, y [m/s], yaw [rad/s]; linear between them.
        end: End of the plan [s].
        period: Period of the control ticks [s].

    Returns:
        What is written as JSON.
    """
    outline_x = [x for x, _ in robot.sole_outline]
    middle = 0.5 * (min(outline_x) + max(outline_x))
    walking = set(robot.leg_joints)
    held = {
        name: float(angle)
        for name, angle in zip(robot.joint_names, robot.stand_pose, strict=True)
        if name not in walking
    }
    return {
        "urdf": with_placo_frames(robot, middle),
        "joints": robot.joint_names,
        "held": held,
        "coupled": robot.coupled_joints,
        "foot_ahead": middle,
        "knots": knots,
        "begin": STAND_TIME,
        "end": end,
        "period": period,
        "replan": REPLAN,
        "walk": {**WALK, "foot_length": max(outline_x) - min(outline_x)},
    }


def with_placo_frames(robot: RobotDescription, foot_ahead: float) -> str:
    """The URDF with the three frames that placo needs; `foot_ahead` [m] of the sole frames in x."""
    model = ET.fromstring(robot.urdf)
    frames = {"trunk": (robot.torso_frame, 0.0)}
    for name, sole in zip(("left_foot", "right_foot"), robot.sole_frames, strict=True):
        frames[name] = (sole, foot_ahead)
    for name, (parent, x) in frames.items():
        ET.SubElement(model, "link", name=name)
        joint = ET.SubElement(model, "joint", name=f"{name}_frame", type="fixed")
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=name)
        ET.SubElement(joint, "origin", xyz=f"{x:.6g} 0 0", rpy="0 0 0")
    return ET.tostring(model, encoding="unicode")


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1] if lines else ""
