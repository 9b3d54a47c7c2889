"""A robot whose motors get hot while it walks, over ROS."""

from pathlib import Path

import pytest
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import BatteryState, Temperature
from std_msgs.msg import String

from ros_probe import Driver, Probe

pytest.importorskip("mujoco")
HOT_PLANT = """
base: reference
heat: {enabled: true, ambient: 50, rise: 150, time_constant: 8, fade_from: 110, limit: 150}
"""


def test_a_robot_with_a_hot_leg_sits_down_and_says_so(probe: Probe, tmp_path: Path) -> None:
    plant = tmp_path / "hot.yaml"
    plant.write_text(HOT_PLANT)
    driver = Driver(probe)
    truth = probe.subscribe(Odometry, "ground_truth/odom")
    temperature = probe.subscribe(Temperature, "temperature")
    battery = probe.subscribe(BatteryState, "battery")
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    result = probe.subscribe(String, "gait/motion_result", latched)
    gait = probe.start("gait", urdf="nao_v6", bias_wait=0.0, hot_speed=0.5)
    probe.start(
        "sim_bridge", urdf="nao_v6", engine="mujoco", plant=plant, lockstep=True, real_time_factor=0
    )
    # Discovery takes real time, in which a robot as fast as possible walks itself hot.
    probe.wait(lambda: temperature and battery and truth, "the sensors")
    driver.forward = 0.2
    probe.wait(lambda: result and result[-1].data == "sit: done", "a robot that sits")
    assert gait.says(r"is hot: \d+ deg C; walking at 50 % of the commanded velocity")
    assert gait.says(r"deg C: sitting down; ~/stand stands up again")
    assert 0.2 < truth[-1].pose.pose.position.z < 0.26
    hot = "the temperature of a hot motor"  # it may still wait behind other messages
    probe.wait(lambda: max(each.temperature for each in temperature) >= 78.0, hot)
    assert {"LKneePitch", "HeadYaw"} <= {each.header.frame_id for each in temperature}
    assert 0.0 < battery[-1].percentage < 1.0
