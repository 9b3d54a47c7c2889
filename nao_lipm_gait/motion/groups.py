"""Groups of joints that a motion can name: head, arms, legs, and their sides."""

from functools import lru_cache

from nao_lipm_gait.motion.mirror import LEFT, RIGHT, mirror_law
from nao_lipm_gait.robot import RobotDescription

HEAD, BODY = "head", "body"


@lru_cache(maxsize=8)
def joint_groups(robot: RobotDescription) -> dict[str, list[int]]:
    """Name -> indices of joints: all, head, body (all but the head), legs, arms, and left_leg,
    right_leg, left_arm, right_arm. Joints of the middle belong to the head if their name says so,
    and otherwise only to the body.
    """
    names = robot.joint_names
    law = mirror_law(robot)
    legs = {
        "left_leg": [names.index(joint) for joint in robot.left_leg.names],
        "right_leg": [names.index(joint) for joint in robot.right_leg.names],
    }
    of_legs = {*legs["left_leg"], *legs["right_leg"]}
    paired = [i for i in range(len(names)) if law.partner[i] != i and i not in of_legs]
    arms = {
        "left_arm": [i for i in paired if names[i].startswith(LEFT)],
        "right_arm": [i for i in paired if names[i].startswith(RIGHT)],
    }
    head = [i for i, name in enumerate(names) if name.lower().startswith(("head", "neck"))]
    return {
        "all": list(range(len(names))),
        HEAD: head,
        BODY: [i for i in range(len(names)) if i not in head],
        "legs": sorted(of_legs),
        "arms": paired,
        **legs,
        **arms,
    }
