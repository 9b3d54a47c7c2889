"""`nao_gait estimate`: recorded sensors against the truth of a simulation, and a real recording."""

import importlib.util
import json
import os
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gait_lab import cli
from gait_lab.analysis.bag import TYPES, BagWriter
from gait_lab.estimate.command import errors, truth_of
from gait_lab.estimate.estimator import by_legs_alone, estimate, quiet_stand
from gait_lab.estimate.recorded_body import RecordedBody
from gait_lab.estimate.sensor_log import load_log
from robot_core.resources import find, share
from robot_core.robot import load_robot
from urdf_edits import Xml, edited_urdf

ICUB = Path(os.environ.get("NAO_GAIT_ICUB_WALK", "/nowhere"))
"""The folder with walk.npz and model.urdf of iCub's recorded walk; not in the repository."""
ROBOT = "nao_v6"
pytestmark = pytest.mark.usefixtures("mujoco_only")


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A curve of 6 s, as the example records it."""
    path = share("config").parent / "examples" / "estimate.py"
    spec = importlib.util.spec_from_file_location("example_estimate", path)
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    file = tmp_path_factory.mktemp("log") / "walk.npz"
    example.record(file, 6)
    return file


def edited(walk: Path, path: Path, **changes: Any) -> Path:
    """The walk with other arrays; None leaves one out."""
    with np.load(walk) as file:
        arrays = {name: file[name] for name in file.files} | changes
    np.savez(path, **{name: each for name, each in arrays.items() if each is not None})
    return path


def found_errors(walk: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Errors of the estimate and of the legs alone."""
    log = load_log(walk)
    body = RecordedBody(ROBOT, log.joint_names)
    truth = truth_of(log.reference, body)
    both = (errors(each(log, body), truth) for each in (estimate, by_legs_alone))
    estimated, legs = ({name: value for name, (value, _) in each.items()} for each in both)
    return estimated, legs


def test_the_estimate_is_near_the_truth_and_better_than_the_legs(walk: Path) -> None:
    estimated, legs = found_errors(walk)
    assert estimated["tilt_rms"] < 0.5 < legs["tilt_rms"]
    assert estimated["yaw_end"] < 2.0
    assert estimated["place_end"] < 2.5


def test_without_forces_the_lower_sole_stands(walk: Path, tmp_path: Path) -> None:
    nothing = {"left_force_z": None, "right_force_z": None}
    estimated, legs = found_errors(edited(walk, tmp_path / "walk.npz", **nothing))
    assert estimated["tilt_rms"] < 0.7 < legs["tilt_rms"]
    assert estimated["place_end"] < 4.0


def test_a_constant_gyro_bias_is_found_in_the_stand(walk: Path, tmp_path: Path) -> None:
    with np.load(walk) as file:
        rate = file["imu_angular_velocity"]
    biased = edited(walk, tmp_path / "walk.npz", imu_angular_velocity=rate + [0.05, -0.04, 0.06])
    before, _ = found_errors(walk)
    after, _ = found_errors(biased)
    for name, value in before.items():
        assert after[name] == pytest.approx(value, abs=1e-6), name


def test_without_a_yaw_gyro_it_says_that_yaw_is_by_the_legs(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with np.load(walk) as file:
        rate = file["imu_angular_velocity"]
    two = edited(walk, tmp_path / "walk.npz", imu_angular_velocity=rate * [1.0, 1.0, 0.0])
    for log, says in ((two, True), (walk, False)):
        assert cli.main(["estimate", str(log), "--robot", ROBOT, "--out", str(tmp_path)]) == 0
        assert ("no yaw gyro" in capsys.readouterr().out) == says


def test_a_quiet_stand_is_the_longest_stretch_without_rotation() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    rate, force = np.zeros((len(time), 3)), np.tile([0.0, 0.0, 9.81], (len(time), 1))
    rate[:, 1] = np.where((time < 1.0) | (time > 4.6), np.sin(20.0 * time), 0.0)
    quiet = quiet_stand(time, rate, force)
    assert time[quiet.start] == pytest.approx(1.0, abs=0.02)
    assert time[quiet.stop] == pytest.approx(4.5, abs=0.02)
    assert quiet_stand(time, rate + np.sin(9.0 * time)[:, None], force) == slice(0, 0)


def test_table_figure_arrays_and_json(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, rows = tmp_path / "out", tmp_path / "rows.json"
    words = ["estimate", str(walk), "--robot", ROBOT, "--out", str(out), "--json", str(rows)]
    assert cli.main(words) == 0
    assert "tilt_rms" in capsys.readouterr().out
    values = {row["metric"]: row["value"] for row in json.loads(rows.read_text())}
    estimated, _ = found_errors(walk)
    assert values["place_end"] == estimated["place_end"]
    assert (out / "estimate.png").stat().st_size > 10_000
    with np.load(out / "estimate.npz") as arrays:
        assert arrays["com"].shape == arrays["up"].shape == arrays["position"].shape
        assert np.median(arrays["com"][:, 2]) == pytest.approx(0.26, abs=0.02)


def test_a_bag_gives_the_same_estimate(walk: Path, tmp_path: Path) -> None:
    types = TYPES.types
    header = types["std_msgs/msg/Header"]
    vector, quaternion = (types[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Quaternion"))
    with np.load(walk) as file:
        arrays = {name: file[name] for name in file.files}
    names, covariance = arrays["joint_names"].tolist(), np.zeros(9)
    no_joints, topics = np.zeros(len(names)), set[str]()
    with BagWriter(tmp_path / "bag") as writer:
        for index, time in enumerate(arrays["time"]):
            stamp = round(1e9 * time)
            at = types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9))
            messages = {
                "/joint_states": types["sensor_msgs/msg/JointState"](
                    header(at, ""), names, arrays["joint_position"][index], no_joints, no_joints
                ),
                "/imu/data": types["sensor_msgs/msg/Imu"](
                    header(at, "torso"), quaternion(0.0, 0.0, 0.0, 1.0), covariance,
                    vector(*arrays["imu_angular_velocity"][index]), covariance,
                    vector(*arrays["imu_specific_force"][index]), covariance,
                ),
            }  # fmt: skip
            for side in ("left", "right"):
                force = vector(0.0, 0.0, arrays[f"{side}_force_z"][index])
                wrench = types["geometry_msgs/msg/Wrench"](force, vector(0.0, 0.0, 0.0))
                kind = types["geometry_msgs/msg/WrenchStamped"]
                messages[f"/{side[0]}_sole/wrench"] = kind(header(at, ""), wrench)
            for topic, message in messages.items():
                kind = message.__msgtype__
                if topic not in topics:
                    writer.add_topic(topic, kind)
                    topics.add(topic)
                writer.write(topic, stamp, bytes(TYPES.serialize_cdr(message, kind)))
    log = load_log(tmp_path / "bag")
    assert log.reference is None
    assert log.imu == "torso"
    body = RecordedBody(ROBOT, log.joint_names, log.imu)
    expected = estimate(load_log(walk), RecordedBody(ROBOT, log.joint_names))
    assert estimate(log, body).position == pytest.approx(expected.position, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"time": None}, "arrays time"),
        ({"joint_position": None}, "joint_position in .* got 'missing'"),
        ({"imu_specific_force": np.zeros((3, 3))}, r"imu_specific_force .* got '\(3, 3\)"),
        ({"base_rpy": None}, "base_rpy .* got 'missing'"),
        ({"right_force_z": None}, "right_force_z .* got 'missing'"),
        ({"time": np.zeros(7)}, r"numbers \(7"),
        ({"joint_names": np.array(["Tail"] + 21 * ["HeadYaw"])}, "joint of the log: got 'Tail'"),
    ],
)
def test_a_bad_log_is_refused_in_one_line(
    walk: Path, tmp_path: Path, changes: dict[str, Any], said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    path = edited(walk, tmp_path / "bad.npz", **changes)
    assert cli.main(["estimate", str(path), "--robot", ROBOT]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(said, line), line


def with_imu(name: str, parent: str) -> Xml:
    """Add a link that is fixed to another one."""

    def edit(root: ET.Element) -> None:
        ET.SubElement(root, "link", name=name)
        joint = ET.SubElement(root, "joint", name=f"{name}_fixed", type="fixed")
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=name)

    return edit


def test_the_imu_is_the_only_one_that_is_fixed_to_the_root(walk: Path, tmp_path: Path) -> None:
    names = load_log(walk).joint_names
    head = edited_urdf(tmp_path, with_imu("head_imu", "Head"))
    assert RecordedBody(str(head), names).root == "base_link"
    two = edited_urdf(tmp_path, with_imu("second_imu", "torso"))
    with pytest.raises(ValueError, match=r"imu_link.*second_imu"):
        RecordedBody(str(two), names)
    assert RecordedBody(str(two), names, imu="second_imu").mass > 4.0
    for link in ("l_sole", "tail"):
        with pytest.raises(ValueError, match=link):
            RecordedBody(ROBOT, names, imu=link)


def test_a_robot_without_sole_links_gets_them(tmp_path: Path) -> None:
    text = find("urdf", "booster_t1").read_text()
    text = re.sub(r'name="booster_t1"', 'name="somebody"', text)
    text = re.sub(r'\b(joint name|link|name)="(?!somebody)', r'\1="my_', text)
    path = tmp_path / "somebody.urdf"
    path.write_text(text)
    assert '"l_sole"' not in text
    robot = load_robot(path)
    body = RecordedBody(str(path), robot.joint_names, imu=robot.imu_frame)
    named = RecordedBody(
        str(path), robot.joint_names, robot.imu_frame, ("my_l_sole", "my_r_sole")
    )
    stand = robot.stand_pose
    for sole, given in zip(body.set_joints(stand)[1:], named.set_joints(stand)[1:], strict=True):
        assert sole.position[2] == pytest.approx(given.position[2], abs=0.005)


def test_a_log_that_is_no_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    with pytest.raises(ValueError, match="No such file"):
        load_log(path)
    path.write_bytes(b"text")
    with pytest.raises(ValueError, match=r"an \.npz file"):
        load_log(path)


@pytest.mark.skipif(
    not (ICUB / "walk.npz").is_file(),
    reason="NAO_GAIT_ICUB_WALK names no folder with walk.npz and model.urdf of iCub's walk",
)
def test_a_real_walk_of_icub() -> None:
    log = load_log(ICUB / "walk.npz")
    body = RecordedBody(str(ICUB / "model.urdf"), log.joint_names)
    assert body.mass == pytest.approx(33.08, abs=0.01)
    truth = truth_of(log.reference, body)
    found, legs = errors(estimate(log, body), truth), errors(by_legs_alone(log, body), truth)
    assert found["tilt_rms"][0] < 0.6 < legs["tilt_rms"][0]
    assert found["yaw_end"][0] < 2.0 < legs["yaw_end"][0]
    assert found["place_end"][0] < 5.0 < legs["place_end"][0]
