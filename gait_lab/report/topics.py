"""Which topic of a bag plays which part, whatever namespace the robot walked in."""

from collections.abc import Mapping
from dataclasses import dataclass

from gait_lab.analysis.bag_reading import TopicSummary

JOINT_STATE = "sensor_msgs/msg/JointState"
POINT = "geometry_msgs/msg/PointStamped"
WRENCH = "geometry_msgs/msg/WrenchStamped"
STRING = "std_msgs/msg/String"
ODOMETRY = "nav_msgs/msg/Odometry"
TWISTS = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")


@dataclass(frozen=True, slots=True)
class Part:
    """One topic of the contract."""

    topic: str
    """Its name where nobody remapped anything."""
    types: tuple[str, ...]
    without: str
    """What a report cannot say without it."""
    optional: bool = False
    """Not worth a word when it is missing."""


PARTS: Mapping[str, Part] = {
    "joints": Part("/joint_states", (JOINT_STATE,), "joints, saturation, timing and the 3D replay"),
    "targets": Part("/joint_command", (JOINT_STATE,), "joint targets against measured"),
    "command": Part("/cmd_vel", TWISTS, "the speeds that were asked for"),
    "truth": Part("/ground_truth/odom", (ODOMETRY,), "true speeds and path (odometry instead)"),
    "true_com": Part("/ground_truth/com", (POINT,), "the CoM error against truth"),
    "odometry": Part("/odom", (ODOMETRY,), "the gait's own odometry"),
    "expected": Part("/gait/com_expected", (POINT,), "the expected CoM and the innovation"),
    "measured": Part("/gait/com_measured", (POINT,), "the measured CoM and the innovation"),
    "estimated": Part("/gait/com_estimated", (POINT,), "the estimated CoM"),
    "support": Part("/gait/support", (STRING,), "steps and the state of the gait"),
    "footsteps": Part("/gait/footsteps", ("visualization_msgs/msg/MarkerArray",),
                      "step sizes and pendulum origins"),
    "left_sole": Part("/l_sole/wrench", (WRENCH,), "the share of flight"),
    "right_sole": Part("/r_sole/wrench", (WRENCH,), "the share of flight"),
    "diagnostics": Part("/diagnostics", ("diagnostic_msgs/msg/DiagnosticArray",),
                        "the gait's own tick times"),
    "push": Part("/push", (WRENCH,), "pushes", optional=True),
    "clock": Part("/clock", ("rosgraph_msgs/msg/Clock",), "the simulated clock", optional=True),
    "description": Part("/robot_description", (STRING,), "the robot's own URDF", optional=True),
}  # fmt: skip


def find_parts(topics: Mapping[str, TopicSummary]) -> dict[str, str]:
    """Part -> topic. By its full name; else the only one of that type with the same end."""
    found: dict[str, str] = {}
    for name, part in PARTS.items():
        if _fits(topics, part.topic, part):
            found[name] = part.topic
    for name, part in PARTS.items():
        if name in found:
            continue
        ends = (part.topic, "/" + part.topic.rsplit("/", 1)[1])
        for end in ends:
            candidates = [
                topic
                for topic in topics
                if topic.endswith(end) and _fits(topics, topic, part)
                and topic not in found.values()
                and ("ground_truth" in topic) == ("ground_truth" in part.topic)
            ]  # fmt: skip
            if len(candidates) == 1:
                found[name] = candidates[0]
                break
    return found


def missing_parts(found: Mapping[str, str]) -> list[str]:
    """In words, what is not in the bag and what that costs."""
    return [
        f"{part.topic} ({part.types[0]}): without it, no {part.without}"
        if not part.without.startswith(("true", "the"))
        else f"{part.topic} ({part.types[0]}): missing are {part.without}"
        for name, part in PARTS.items()
        if name not in found and not part.optional
    ]


def _fits(topics: Mapping[str, TopicSummary], topic: str, part: Part) -> bool:
    summary = topics.get(topic)
    return summary is not None and summary.count > 0 and summary.type in part.types
