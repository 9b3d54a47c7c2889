"""LoLA messages for tests."""

from typing import Any

from lola_bridge.codec import LolaSensors, RobotConfig
from lola_bridge.joints import JointMap, sitting_pose
from lola_bridge.safety import SafetySettings
from robot_core.robot import load_robot

LIGHTS: dict[str, Any] = {
    **{key: [0.5] * count for key, count in (
        ("REar", 10), ("LEar", 10), ("LEye", 24), ("REye", 24), ("LFoot", 3), ("RFoot", 3),
        ("Skull", 12),
    )},
    "Sonar": [True, False],
}  # fmt: skip
"""Every key of a command that moves nothing."""
CONFIG = RobotConfig("P0000073A07S94700012", "6.0.0", "P0000074A05S93M00061", "6.0.0")


def sensors(**changes: Any) -> LolaSensors:
    """Sensors of a limp robot that stands upright."""
    frame = LolaSensors(
        stiffness=[0.0] * 25, position=[0.0] * 25, temperature=[38.0] * 25,
        battery=[0.9, 0.0, -1.0, 35.0], current=[0.1] * 25, status=[0] * 25,
        accelerometer=[0.0, 0.0, -9.81], gyroscope=[0.0] * 3, angles=[0.0] * 2, sonar=[1.0] * 2,
        fsr=[0.67] * 8, touch=[0.0] * 14, robot_config=CONFIG,
    )  # fmt: skip
    return frame._replace(**changes)


ROBOT = load_robot("nao_v6")
MAP = JointMap(ROBOT)
LOWER, UPPER, SPEED = MAP.limits()
SIT = MAP.from_gait(sitting_pose(ROBOT))
STAND = MAP.from_gait(ROBOT.stand_pose)
SAFETY = SafetySettings(
    period=0.012, stiffness_ramp=0.12, silence_time=0.06, sit_time=1.2, lower=LOWER, upper=UPPER,
    speed=SPEED, driven=MAP.driven, sit=SIT,
)  # fmt: skip
