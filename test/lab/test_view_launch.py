"""What walk.launch.py starts beside the nodes. Needs launch_ros, which PyPI does not have."""

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("launch_ros", reason="no launch_ros (it comes with a full ROS)")

from launch import LaunchContext

from nao_lipm_gait.resources import share
from nao_lipm_gait.robot import load_robot


@pytest.fixture
def walk() -> Any:
    spec = spec_from_file_location("walk_launch", share("launch", "walk.launch.py"))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def context(walk: Any, **given: str) -> Any:
    made = LaunchContext()
    defaults = {"namespace": ""} | {name: "" for name, *_ in walk.ARGUMENTS}
    defaults |= {name: default for name, default, _ in walk.EXTRAS}
    made.launch_configurations.update(defaults | given)
    return made


def test_nothing_extra_is_started_unless_asked(walk: Any) -> None:
    assert walk._extras(context(walk)) == []


def test_rviz_a_recorder_and_tf_are_started(walk: Any, tmp_path: Path) -> None:
    asked = context(
        walk, rviz="true", record=str(tmp_path / "bag"), robot_state_publisher="true"
    )
    assert len(walk._extras(asked)) == 4
    with pytest.raises(ValueError, match="rviz: got 'maybe'"):
        walk._extras(context(walk, rviz="maybe"))
    with pytest.raises(ValueError, match=r"record: .*does not exist yet"):
        walk._extras(context(walk, record=str(tmp_path)))


def test_the_drawn_robot_stands_on_the_ground(walk: Any) -> None:
    x, z = walk._footprint_in_base(load_robot())
    assert abs(x) < 0.05
    assert -0.36 < z < -0.2


def test_every_argument_is_described(walk: Any) -> None:
    arguments = walk.generate_launch_description().get_launch_arguments()
    assert {"gui", "rviz", "record", "plant", "robot_seed", "sensor_delay",
            "real_time_factor"} <= {argument.name for argument in arguments}  # fmt: skip
    assert all(re.search(r"\w{4}", argument.description) for argument in arguments)
