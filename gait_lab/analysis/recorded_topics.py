"""Which topics of a bag are those of the ROS interface, in any namespace, of one robot."""

from collections.abc import Mapping
from dataclasses import dataclass

from gait_lab.analysis.bag import TopicSummary
from robot_core.errors import NaoGaitError

JOINT_STATE = "sensor_msgs/msg/JointState"
POINT = "geometry_msgs/msg/PointStamped"
WRENCH = "geometry_msgs/msg/WrenchStamped"
STRING = "std_msgs/msg/String"
ODOMETRY = "nav_msgs/msg/Odometry"
TWISTS = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")


@dataclass(frozen=True, slots=True)
class Part:
    """One topic of the ROS interface.

    Attributes:
        topic: Its name without remapping.
        types: Accepted message types.
        without: What is unknown without it.
        optional: Not mentioned if it is missing.
    """

    topic: str
    types: tuple[str, ...]
    without: str
    optional: bool = False


PARTS: Mapping[str, Part] = {
    "joints": Part("/joint_states", (JOINT_STATE,), "joints, saturation, timing and the 3D replay"),
    "targets": Part("/joint_command", (JOINT_STATE,), "joint targets against measured"),
    "command": Part("/cmd_vel", TWISTS, "the commanded speeds"),
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
    "percepts": Part("/vision/percepts", ("sensor_msgs/msg/PointCloud2",), "percepts",
                     optional=True),
    "ball": Part("/ground_truth/ball", (POINT,), "the error of the seen ball", optional=True),
    "scene": Part("/scene_description", (STRING,), "the errors of percepts", optional=True),
    "own_pose": Part("/pose", ("geometry_msgs/msg/PoseWithCovarianceStamped",), "the own pose",
                     optional=True),
    "own_valid": Part("/pose_valid", ("std_msgs/msg/Bool",), "its validity", optional=True),
    "own_ball": Part("/ball", (ODOMETRY,), "the player's ball", optional=True),
}  # fmt: skip


def may_be_part(topic: str, kind: str) -> bool:
    """Whether a topic of a message type can be a part, of any robot."""
    return any(
        kind in part.types and topic.endswith("/" + part.topic.rsplit("/", 1)[1])
        for part in PARTS.values()
    )


def robots_in(topics: Mapping[str, TopicSummary]) -> dict[str, str]:
    """Prefix of the topics, `/red1`, by the name of each robot that has a namespace."""
    end = PARTS["joints"].topic
    prefixes = [name[: -len(end)] for name in sorted(topics) if name.endswith(end)]
    return {prefix.rsplit("/", 1)[1]: prefix for prefix in prefixes if prefix}


def topics_of(
    topics: Mapping[str, TopicSummary], robot: str
) -> tuple[str, dict[str, TopicSummary]]:
    """Prefix and topics of one robot out of a bag: its own and those of the world.

    Args:
        topics: All topics of the bag.
        robot: Name of the robot; "" for the only one.

    Raises:
        NaoGaitError: There is no such robot, or it is not said which of several.
    """
    robots = robots_in(topics)
    if (robot and robot not in robots) or (not robot and len(robots) > 1):
        allowed = (
            f"one of {', '.join(robots)}" if robots else
            "without this option: the robot of this bag has no name"
        )
        raise NaoGaitError("--robot", robot or "nothing", allowed)
    prefix = robots[robot] if robot else next(iter(robots.values()), "")
    others = tuple(f"{each}/" for each in robots.values() if each != prefix)
    own = {name: each for name, each in topics.items() if not name.startswith(others)}
    return prefix, own


def find_parts(topics: Mapping[str, TopicSummary]) -> dict[str, str]:
    """Topic by part: by its full name, else the only topic of its type with the same ending."""
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
    """What is missing in the bag, in words, and what is unknown without it."""
    return [
        f"{part.topic} ({part.types[0]}), and with it {part.without}"
        for name, part in PARTS.items()
        if name not in found and not part.optional
    ]


def _fits(topics: Mapping[str, TopicSummary], topic: str, part: Part) -> bool:
    summary = topics.get(topic)
    return summary is not None and summary.count > 0 and summary.type in part.types
