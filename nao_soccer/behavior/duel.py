"""The constants of play beside other robots: distances to keep, and the duel for the ball."""

import attrs

from robot_core.schema import Settings, number


@attrs.frozen
class DuelSettings(Settings):
    """How a robot plays beside others."""

    contested: float = number(
        0.5, 0.0, 3.0, "m", "From another robot to the ball: nearer ones make it a duel."
    )
    ahead: float = number(0.3, 0.1, 3.0, "m", "Farthest ball, ahead, that is pushed in a duel.")
    aside: float = number(0.16, 0.05, 1.0, "m", "How far beside the robot such a ball may lie.")
    heading: float = number(
        0.3, -1.0, 1.0, "", "Least cosine of the angle between the heading of a robot that pushes "
        "and the way to the opponents' end.",
    )  # fmt: skip
    apart: float = number(
        0.36, 0.1, 2.0, "m",
        "Kept between the middles of two robots, which do not touch then, nor their arms.",
    )  # fmt: skip
    apart_wide: float = number(
        0.5, 0.1, 2.0, "m",
        "The same of a robot that does not play the ball, or beside one that lies, gets up, or is "
        "nearer to the ball: two robots at one ball fall.",
    )  # fmt: skip
    gain: float = number(
        0.5, 0.05, 20.0, "1/s", "Fastest approach to another robot, over the room that is left."
    )
    gain_ball: float = number(
        1.0, 0.05, 20.0, "1/s",
        "The same of a robot that plays the ball between them: its walk follows 0.3 s "
        "later, and the other one may come as fast.",
    )  # fmt: skip
    lift: float = number(
        0.5, 0.0, 1.0, "",
        "Share of its usual height by which a robot lifts its feet beside others: a low foot "
        "pushes where a high one treads on theirs.",
    )  # fmt: skip
    lift_near: float = number(
        1.0, 0.0, 5.0, "m", "From another robot, up to which feet are lifted by that share."
    )
    receive_ahead: float = number(
        1.2, 0.0, 20.0, "m", "Ahead of the ball, where a supporter waits for what gets through."
    )
    receive_aside: float = number(
        0.25, 0.0, 0.5, "", "Share of the field's width from its middle, where it waits."
    )
