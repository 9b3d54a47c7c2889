"""`nao_gait calibrate` with a running robot; a gait that is given its file starts level."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from rcl_interfaces.srv import GetParameters
from std_msgs.msg import String

from nao_lipm_gait.calibration_file import load_calibration
from nao_lipm_gait.runtime.calibration_monitor import Measurement
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.robot import load_robot
from robot_core.ros.lockstep import LockstepPartner
from robot_core.ros.process import DomainClaim
from robot_core.ros.topics import LATCHED
from robot_core.types import LEFT, RIGHT
from ros_probe import TIMEOUT, Probe
from sim_bridge.individual import draw_individual
from sim_bridge.plant import load_plant
from sim_bridge.trials.calibration_procedure import POSED

FAST = {"lockstep": True, "real_time_factor": 0.0, "engine": "mujoco"}
ROBOT = 2
"""One whose soles are more than 1 deg from parallel in pitch and in roll."""

pytest.importorskip("mujoco")


def calibrate(domain: DomainClaim, out: Path, *options: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "gait_lab.cli", "calibrate", "--out", str(out), *options],
        env=domain.environment(), text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def measurement(messages: list[Any]) -> Measurement | None:
    """The first that the gait has reported."""
    for message in messages:
        for status in message.status:
            if status.name == "gait: calibration":
                return Measurement.read({each.key: each.value for each in status.values})
    return None


def true_tilt() -> tuple[float, float]:
    """Pitch and roll [rad] of the left sole relative to the right one, by the joint zeros."""
    robot = load_robot()
    body = BodyModel(robot)
    zeros = draw_individual(load_plant("reference"), robot, ROBOT).joint_zero
    body.set_joints(robot.stand_pose + zeros)
    left, right = (body.sole_in_torso(leg).normal for leg in (LEFT, RIGHT))
    return left[0] - right[0], right[1] - left[1]


def test_a_calibrated_gait_starts_with_level_soles(probe: Probe, tmp_path: Path) -> None:
    out = tmp_path / "new" / "calibration.yaml"
    support = probe.subscribe(String, "gait/support", LATCHED)
    gait = probe.start("gait")
    probe.start("sim_bridge", robot_seed=ROBOT, **FAST)
    probe.wait(lambda: support, "the gait's state")
    tool = calibrate(probe.domain, out)
    probe.wait(lambda: tool.poll() is not None, "the end of the calibration", 3.0 * TIMEOUT)
    said, errors = tool.communicate()
    assert tool.returncode == 0, errors
    # Before them it says "standing", unless the robot has stood long enough already.
    phases = [line for line in said.splitlines() if line.startswith("st")]
    assert phases[-2:] == ["stepping on the spot", "standing on level soles"]
    measured = load_calibration(out, load_robot())
    truth, found = true_tilt(), (measured.sole_pitch, measured.sole_roll)
    assert min(np.abs(truth)) > np.radians(1.0)
    deviation = yaml.safe_load(out.read_text())["deviation"]
    sigma = np.array((deviation["sole_pitch"], deviation["sole_roll"]))
    assert max(sigma) < np.radians(0.35)
    assert (np.abs(np.subtract(found, truth)) < 3.0 * sigma).all(), "as well as the file says"
    word = "soles measured, the ankles correct them"
    probe.wait(lambda: gait.says(word), word)
    probe.wait(lambda: support[-1].data.startswith("stand"), "a stand")

    gait.end()
    reports = probe.subscribe(DiagnosticArray, "/diagnostics")
    probe.start("gait", calibration=out)
    probe.wait(lambda: measurement(reports), "a report of the gait")
    known = measurement(reports)
    assert known is not None
    assert (known.sole_pitch_applied, known.sole_roll_applied) == found
    assert known.soles_level


@pytest.mark.slow
def test_a_wrong_zero_is_named_and_the_gait_has_its_parameters_back(
    probe: Probe, tmp_path: Path
) -> None:
    plant, out = tmp_path / "plant.yaml", tmp_path / "calibration.yaml"
    plant.write_text(
        "base: reference\nvariation: {wrong_joint: RKneePitch, wrong_zero: 0.06}\n"
    )
    support = probe.subscribe(String, "gait/support", LATCHED)
    probe.start("gait", urdf="nao_v6")
    probe.start("sim_bridge", urdf="nao_v6", robot_seed=44, plant=plant, **FAST)
    probe.wait(lambda: support, "the gait's state")

    def posed() -> list[float]:
        request = GetParameters.Request(names=list(POSED))
        values = probe.call(GetParameters, "gait/get_parameters", request).values
        return [value.double_value for value in values]

    before = posed()
    tool = calibrate(probe.domain, out, "--zeros")
    probe.wait(lambda: tool.poll() is not None, "the end of the calibration", 9.0 * TIMEOUT)
    said, errors = tool.communicate()
    assert tool.returncode == 0, errors
    assert "a zero is wrong: that of RKneePitch by +" in said
    alone = ", or that of " not in said  # by the noise of this run
    assert len(load_calibration(out, load_robot("nao_v6")).joint_zero) == alone
    assert posed() == before


def test_a_command_of_somebody_else_ends_it_without_a_file(probe: Probe, tmp_path: Path) -> None:
    out = tmp_path / "calibration.yaml"
    out.write_text("an older one")
    support = probe.subscribe(String, "gait/support", LATCHED)
    probe.start("gait", enable_stamped_cmd_vel=True, bias_wait=0.0)
    # Time waits for this test, which otherwise may come after the end of the calibration.
    LockstepPartner(probe.node).keep_up()
    probe.start("sim_bridge", robot_seed=ROBOT, lockstep_nodes="probe", **FAST)
    probe.wait(lambda: support, "the gait's state")
    other = probe.publisher(TwistStamped, "cmd_vel")
    tool = calibrate(probe.domain, out)
    # The tool's own commands have the type that this gait expects.
    probe.wait(lambda: any(m.data.startswith("walk") for m in support), "steps on the spot")
    message = TwistStamped()
    message.twist.linear.x = 0.1
    probe.wait(
        lambda: tool.poll() is not None, "the end of the calibration",
        every=lambda: other.publish(message),
    )  # fmt: skip
    _, errors = tool.communicate()
    assert tool.returncode == 1
    assert "somebody else commands the robot" in errors
    assert len(errors.splitlines()) == 1
    assert out.read_text() == "an older one"
    probe.wait(lambda: support[-1].data.startswith("stand"), "a robot that stands again")


def test_without_a_gait_or_a_robot_it_says_so(probe: Probe, tmp_path: Path) -> None:
    out = tmp_path / "calibration.yaml"
    reports = probe.subscribe(DiagnosticArray, "/diagnostics")
    probe.start("gait")
    probe.wait(lambda: reports, "a report of the gait")
    with DomainClaim() as empty:
        alone, without_robot = calibrate(empty, out), calibrate(probe.domain, out)
        for tool, reason in ((alone, "a running gait"), (without_robot, "a running robot")):
            _, errors = tool.communicate(timeout=TIMEOUT)
            assert tool.returncode == 2
            assert reason in errors
            assert len(errors.splitlines()) == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("robot: bruno\ncalibration: {}\n", "robot: got 'bruno'; allowed: nao_h21"),
        ("robot: nao_h21\ncalibration: {sole_pitch: 3}\n", "sole_pitch: got 3; allowed: a number"),
    ],
)
def test_the_gait_refuses_a_file_that_does_not_fit(
    probe: Probe, tmp_path: Path, text: str, reason: str
) -> None:
    file = tmp_path / "calibration.yaml"
    file.write_text(text)
    gait = probe.start("gait", calibration=file)
    assert gait.wait() == 2
    assert f"parameter calibration: calibration {file}: " in gait.log
    assert reason in gait.log
    assert len(gait.log.splitlines()) == 1
