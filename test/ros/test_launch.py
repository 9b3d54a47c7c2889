"""walk.launch.py starts everything or nothing. Needs launch_ros, which PyPI does not have."""

import re
from pathlib import Path

import pytest
import yaml

pytest.importorskip("launch_ros", reason="no launch_ros (it comes with a full ROS)")

from launch import LaunchDescription, LaunchService
from launch.actions import RegisterEventHandler, SetLaunchConfiguration, Shutdown
from launch.event_handlers import OnProcessStart
from launch.launch_description_sources import PythonLaunchDescriptionSource

from robot_core.resources import share


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An index of installed packages whose executables only sleep."""
    index = tmp_path / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    install(tmp_path, "nao_lipm_gait", "gait", "sim_bridge", "vision", "player", "referee")
    return tmp_path


def install(prefix: Path, package: str, *executables: str) -> None:
    (prefix / "share" / "ament_index" / "resource_index" / "packages" / package).touch()
    (prefix / "share" / package).mkdir(parents=True)
    (prefix / "lib" / package).mkdir(parents=True)
    for name in executables:
        file = prefix / "lib" / package / name
        file.write_text("#!/bin/sh\nexec sleep 60\n")
        file.chmod(0o755)


def launched(expected: int, file: str = "walk", **arguments: str) -> tuple[int, list[str]]:
    """Exit status of the launch, and what it has started; it ends after the expected number."""
    status, commands = launched_commands(expected, file, **arguments)
    return status, [Path(command[0]).name for command in commands]


def launched_commands(
    expected: int, file: str = "walk", **arguments: str
) -> tuple[int, list[list[str]]]:
    """As `launched`, with the command lines."""
    started: list[list[str]] = []

    def note(event: object, _context: object) -> list[Shutdown]:
        started.append(event.cmd)  # type: ignore[attr-defined]
        return [Shutdown()] if len(started) == expected else []

    source = PythonLaunchDescriptionSource(str(share("launch", f"{file}.launch.py")))
    service = LaunchService(noninteractive=True)
    service.include_launch_description(
        LaunchDescription(
            [
                RegisterEventHandler(OnProcessStart(on_start=note)),
                *(SetLaunchConfiguration(name, value) for name, value in arguments.items()),
                source.get_launch_description(service.context),
            ]
        )
    )
    return service.run(), started


def test_both_nodes_are_started(packages: Path) -> None:
    status, started = launched(2)
    assert status == 0
    assert sorted(started) == ["gait", "sim_bridge"]


def test_both_nodes_get_the_robot(packages: Path) -> None:
    _, commands = launched_commands(2, robot="booster_t1")
    assert [parameters(" ".join(command))["robot"] for command in commands] == ["booster_t1"] * 2


def test_a_scene_has_a_gait_for_each_robot(packages: Path) -> None:
    status, started = launched(5, scene="pitch_small")
    assert status == 0
    assert sorted(started) == [*["gait"] * 4, "sim_bridge"]


def test_each_robot_of_a_scene_has_its_namespace_and_its_transforms(packages: Path) -> None:
    install(packages, "robot_state_publisher", "robot_state_publisher")
    _, commands = launched_commands(9, scene="pitch_small", namespace="arena")
    nodes = [(Path(command[0]).name, " ".join(command)) for command in commands]
    robots = ("red1", "red2", "blue1", "blue2")
    for name in ("gait", "robot_state_publisher"):
        own = [line for each, line in nodes if each == name]
        assert len(own) == len(robots)
        for robot in robots:
            (line,) = [line for line in own if f"__ns:=/arena/{robot}" in line]
            assert "/tf:=tf" in line
            assert "/tf_static:=tf_static" in line
    (bridge,) = [line for each, line in nodes if each == "sim_bridge"]
    assert "__ns:=/arena " in f"{bridge} "
    assert "/tf:=" not in bridge


def test_each_robot_of_a_scene_has_its_vision_and_the_bridge_renders(packages: Path) -> None:
    status, commands = launched_commands(9, scene="pitch_small", vision="true", colors="pitch")
    assert status == 0
    nodes = [(Path(command[0]).name, " ".join(command)) for command in commands]
    assert sorted(name for name, _ in nodes) == [*["gait"] * 4, "sim_bridge", *["vision"] * 4]
    for robot in ("red1", "red2", "blue1", "blue2"):
        (line,) = [line for name, line in nodes if name == "vision" and f"__ns:=/{robot}" in line]
        values = parameters(line)
        assert values["scene"] == "pitch_small"
        assert values["colors"] == "pitch"
        assert values["use_sim_time"] is True
        assert "cameras" not in values  # its own parameter of this name selects some
    (bridge,) = [line for name, line in nodes if name == "sim_bridge"]
    assert parameters(bridge)["cameras"] is True
    assert "colors" not in parameters(bridge)


def parameters(command: str) -> dict[str, object]:
    """The parameters of a node, from its command line."""
    found: dict[str, object] = {}
    for file in re.findall(r"--params-file (\S+)", command):
        (node,) = yaml.safe_load(Path(file).read_text()).values()
        found |= node["ros__parameters"]
    return found


def test_transforms_of_the_links_are_published_where_that_is_possible(packages: Path) -> None:
    install(packages, "robot_state_publisher", "robot_state_publisher")
    _, started = launched(3)
    assert sorted(started) == ["gait", "robot_state_publisher", "sim_bridge"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"rviz": "true"}, "rviz: got 'true'; allowed: false, or install the package rviz2"),
        ({"rviz": "maybe"}, "rviz: got 'maybe'; allowed: true or false"),
        ({"record": "."}, "record: got '.'; allowed: a folder that does not exist yet"),
        ({"record": "true"}, "record: got 'true'; allowed: false, or install the package ros2bag"),
        ({"robot_state_publisher": "true"}, "install the package robot_state_publisher"),
        ({"lockstep": "maybe"}, "lockstep: got 'maybe'; allowed: true or false"),
        ({"scene": "stadium"}, "scene: got 'stadium'; allowed: a shipped name"),
        ({"scene": "pitch", "ball": "true"}, "ball: got 'true'; allowed: nothing: it differs"),
        ({"vision": "true"}, "vision: got 'true'; allowed: false, or a scene with a field"),
        ({"scene": "pitch", "vision": "true", "cameras": "false"},
         "cameras: got 'false'; allowed: true, because vision needs images"),
        ({"robot_seed": "x"}, "robot_seed: got 'x'; allowed: a whole number"),
        ({"robot_seed": "-2"}, "robot_seed: got -2; allowed: a whole number from -1"),
        ({"robotseed": "1"}, "robotseed: got '1'; allowed: no such argument; robot_seed is one"),
        ({"engine": "ode"}, "engine: got 'ode'; allowed: one of pybullet, mujoco"),
        ({"preset": "quick"}, "preset"),
        ({"plant": "moon"}, "plant: got 'moon'; allowed: a shipped name"),
        ({"urdf": "atlas"}, "urdf: got 'atlas'; allowed: a shipped name"),
        ({"calibration": "/no/such.yaml"}, "calibration"),
        ({"start_state": "flying"}, "start_state: got 'flying'; allowed: one of stand"),
        ({"sensor_delay": "2.0"}, "sensor_delay: got 2.0; allowed: a number from 0 to 1 s"),
        ({"params_file": "/no/such.yaml"}, "params_file"),
        ({"params_file": str(share("config", "gait", "paper.yaml"))}, "ros__parameters"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_starts(
    packages: Path,
    arguments: dict[str, str],
    reason: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    status, started = launched(-1, **arguments)
    assert status == 1
    assert started == []
    assert reason in caplog.text


def test_a_parameter_file_reaches_every_node_and_arguments_come_before_it(
    packages: Path, tmp_path: Path
) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("/**: {ros__parameters: {robot_seed: 3, swing_lift: 0.02}}")
    _, commands = launched_commands(2, params_file=str(file), robot_seed="4")
    lines = {Path(command[0]).name: " ".join(command) for command in commands}
    assert parameters(lines["gait"])["swing_lift"] == 0.02
    assert parameters(lines["sim_bridge"])["robot_seed"] == 4


def test_a_match_has_all_nodes_of_its_robots_and_a_referee(packages: Path) -> None:
    status, commands = launched_commands(14, "match", minutes="1.0", engine="pybullet")
    assert status == 0
    nodes = [(Path(command[0]).name, " ".join(command)) for command in commands]
    of_robots = sorted([*["gait"] * 4, *["player"] * 4, *["vision"] * 4])
    assert sorted(name for name, _ in nodes) == sorted([*of_robots, "referee", "sim_bridge"])
    values = {name: parameters(line) for name, line in nodes if name in ("referee", "sim_bridge")}
    assert values["referee"]["minutes"] == 1.0
    assert values["sim_bridge"]["lockstep"] is True
    assert values["sim_bridge"]["cameras"] is True
    (player,) = [line for name, line in nodes if name == "player" and "__ns:=/blue2" in line]
    found = parameters(player)
    assert (found["team"], found["number"]) == ("blue", 2)
    assert found["control_port"] == values["referee"]["control_port"]


def test_a_match_needs_a_field(packages: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert launched(-1, "match", scene="floor", engine="pybullet") == (1, [])
    assert "scene: got 'floor'; allowed: a scene with a field and teams" in caplog.text


def test_everything_ends_when_a_node_ends(packages: Path) -> None:
    (packages / "lib" / "nao_lipm_gait" / "gait").write_text("#!/bin/sh\nexit 2\n")
    _, started = launched(-1)  # returns when all processes have ended
    assert sorted(started) == ["gait", "sim_bridge"]
