"""The layouts for RViz, PlotJuggler and Foxglove name topics and fields that there are."""

import json
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import Any

import pytest
import yaml

pytest.importorskip("rclpy")

from gait_lab.analysis.recorded_topics import PARTS
from gait_lab.record.recorder import message_class
from robot_core.resources import share
from robot_core.robot import load_robot

TYPES = {part.topic: part.types[0] for part in PARTS.values()}
JOINT_STATE = "sensor_msgs/msg/JointState"


def check_field(topic: str, names: list[str]) -> None:
    """Refuses a path that is no number in a message of this topic."""
    kind = TYPES[topic]
    if kind == JOINT_STATE:  # PlotJuggler opens these by the names of the joints
        assert names[0] in load_robot().joint_names
        assert names[1] in ("position", "velocity")
        return
    value: Any = message_class(kind)()
    for name in names:
        value = getattr(value, name)
    assert isinstance(value, float)


def topic_of(path: str) -> str:
    return max((topic for topic in TYPES if path.startswith(topic)), key=len)


def test_plotjuggler_curves_are_fields_of_our_topics() -> None:
    root = ET.parse(share("config", "plotjuggler", "walk.xml")).getroot()
    curves = [curve.get("name", "") for curve in root.iter("curve")]
    assert len(curves) > 15
    for curve in curves:
        topic = topic_of(curve)
        check_field(topic, curve.removeprefix(topic).strip("/").split("/"))
    for splitter in root.iter("DockSplitter"):
        areas = splitter.findall("DockArea")
        assert int(splitter.get("count", "")) == len(areas) == splitter.get("sizes", "").count(
            ";"
        ) + 1


def test_foxglove_panels_are_laid_out_and_plot_our_fields() -> None:
    layout = json.loads(share("config", "foxglove", "walk.json").read_text(encoding="utf-8"))

    def leaves(node: Any) -> Iterator[str]:
        if isinstance(node, str):
            yield node
        else:
            yield from leaves(node["first"])
            yield from leaves(node["second"])

    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    paths = [path["value"] for panel in layout["configById"].values()
             for path in panel.get("paths", ())]  # fmt: skip
    assert len(paths) > 8
    for path in paths:
        topic = topic_of(path)
        check_field(topic, path.removeprefix(topic).strip(".").split("."))


def test_rviz_shows_our_topics_in_odom() -> None:
    text = share("config", "rviz", "walk.rviz").read_text(encoding="utf-8")
    manager = yaml.safe_load(text)["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "odom"
    shown = {}
    for display in manager["Displays"]:
        for key in ("Topic", "Description Topic"):
            if key in display:
                shown["/" + display[key]["Value"]] = display["Class"].split("/")[1]
    expected = {"/robot_description": "RobotModel", "/gait/footsteps": "MarkerArray",
                "/odom": "Odometry", "/l_sole/wrench": "Wrench", "/r_sole/wrench": "Wrench"}
    assert shown == expected
    assert set(shown) <= set(TYPES)
