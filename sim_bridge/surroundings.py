"""What surrounds the robots of a world: ground, field, goals, poles and ball. Pure geometry."""

from dataclasses import dataclass

import numpy as np

from robot_core.field import COLORS, SIDES, BallPlace, Field, Goals, Marking, Pole
from sim_bridge.ball import Ball, BallState
from sim_bridge.shapes import Shape
from sim_bridge.terrain import Prism

NET_THICKNESS = 0.04
"""[m]; thick enough that no ball passes through it in a physics step."""
_NET_COLOR = (0.9, 0.9, 0.9, 0.25)
_ALONG_Y = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
"""Turns z into y."""


@dataclass(frozen=True, slots=True)
class Fixture:
    """A thing that does not move.

    Attributes:
        kind: `post`, `bar`, `net` or `pole`. A net takes the speed of a ball.
        shape: In the world.
    """

    name: str
    kind: str
    shape: Shape


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The world without its robots.

    Attributes:
        ball: None = none.
        field: Lines and carpet; None = a plain floor.
        goals: None = none.
    """

    ground: tuple[Prism, ...] = ()
    ball: Ball | None = None
    field: Field | None = None
    goals: Goals | None = None
    poles: tuple[Pole, ...] = ()

    @property
    def markings(self) -> tuple[Marking, ...]:
        """What is painted on the floor."""
        return () if self.field is None else self.field.markings()

    @property
    def carpet(self) -> tuple[float, float] | None:
        """Length and width [m] of the carpet, around the origin; None = no carpet."""
        if self.field is None:
            return None
        border = 2.0 * self.field.border
        return self.field.length + border, self.field.width + border

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """Goals and poles."""
        goals = () if self.field is None or self.goals is None else _goals(self.field, self.goals)
        poles = (each for index, pole in enumerate(self.poles) for each in _pole(index, pole))
        return (*goals, *poles)

    def place_of(self, ball: BallState) -> BallPlace | None:
        """Where the ball is; None without a field."""
        if self.field is None or self.ball is None:
            return None
        x, y, z = ball.position.tolist()
        return self.field.place_of((x, y, z), self.ball.radius, self.goals)


PLAIN_FLOOR = Surroundings()
"""A level floor with nothing on it."""


def _goals(field: Field, goals: Goals) -> list[Fixture]:
    radius, depth = goals.post_diameter / 2.0, goals.depth
    top = goals.height + radius
    posts = field.posts(goals)
    fixtures = []
    for index, team_side in enumerate(SIDES):
        name = f"goal_{index}"
        color = (*COLORS[goals.colors[index]], 1.0)
        line = team_side * field.length / 2.0
        for number, (x, y) in enumerate(posts[2 * index : 2 * index + 2]):
            place = np.array((x, y, top / 2.0))
            post = Shape("cylinder", (radius, top), place, np.eye(3), color)
            fixtures.append(Fixture(f"{name}_post_{number}", "post", post))
        across = goals.width + goals.post_diameter
        bar = Shape("cylinder", (radius, across), np.array((line, 0.0, top)), _ALONG_Y, color)
        fixtures.append(Fixture(f"{name}_bar", "bar", bar))
        half, out = NET_THICKNESS / 2.0, across + 2.0 * NET_THICKNESS
        middle = line + team_side * depth / 2.0
        back = line + team_side * (depth + half)
        side = across / 2.0 + half
        nets = {
            "back": ((NET_THICKNESS, out, top), (back, 0.0, top / 2.0)),
            "right": ((depth, NET_THICKNESS, top), (middle, -side, top / 2.0)),
            "left": ((depth, NET_THICKNESS, top), (middle, side, top / 2.0)),
            "roof": ((depth, out, NET_THICKNESS), (middle, 0.0, goals.height + half)),
        }
        for part, (size, middle_of) in nets.items():
            shape = Shape("box", size, np.array(middle_of), np.eye(3), _NET_COLOR)
            fixtures.append(Fixture(f"{name}_net_{part}", "net", shape))
    return fixtures


def _pole(index: int, pole: Pole) -> list[Fixture]:
    band = pole.height / len(pole.colors)
    return [
        Fixture(
            f"pole_{index}_{number}",
            "pole",
            Shape(
                "cylinder",
                (pole.diameter / 2.0, band),
                np.array((pole.x, pole.y, (number + 0.5) * band)),
                np.eye(3),
                (*COLORS[color], 1.0),
            ),
        )
        for number, color in enumerate(pole.colors)
    ]
