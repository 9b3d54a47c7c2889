"""What a player is in its team."""

from enum import StrEnum


class Role(StrEnum):
    """Role of a player.

    Attributes:
        STRIKER: Goes to the ball.
        SUPPORTER: Keeps out of the striker's way, between ball and own goal.
        KEEPER: Guards the goal.
    """

    STRIKER = "striker"
    SUPPORTER = "supporter"
    KEEPER = "keeper"
