"""The geometry of the field."""

import math

import pytest

from robot_core.field import BallPlace, CrossingKind, Field, Goals, faults

FIELD, GOALS = Field(), Goals()


def on_a_line(x: float, y: float, field: Field = FIELD) -> int:
    """Number of lines and circles whose middle goes through a point."""
    count = 0
    for line in field.lines():
        (x0, y0), (x1, y1) = line.start, line.end
        low_x, high_x, low_y, high_y = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
        count += low_x - 1e-9 <= x <= high_x + 1e-9 and low_y - 1e-9 <= y <= high_y + 1e-9
    return count + (abs(math.hypot(x, y) - field.circle_diameter / 2.0) < 1e-9)


def test_every_crossing_lies_on_two_lines_and_goes_on_along_its_heading() -> None:
    crossings = FIELD.crossings()
    counts = {kind: sum(c.kind is kind for c in crossings) for kind in CrossingKind}
    assert counts == {CrossingKind.L: 12, CrossingKind.T: 10, CrossingKind.X: 2}
    assert len({(c.x, c.y) for c in crossings}) == len(crossings)
    for crossing in crossings:
        assert on_a_line(crossing.x, crossing.y) == 2
        c, s = math.cos(crossing.heading), math.sin(crossing.heading)
        arms = {CrossingKind.L: (1.0,) * 2, CrossingKind.T: (1.0,), CrossingKind.X: (1.0, -1.0)}
        for number, sign in enumerate(arms[crossing.kind]):
            # the arms of an L are at 45 deg on both sides of its heading
            turn = (0.25 - 0.5 * number) * math.pi if crossing.kind is CrossingKind.L else 0.0
            along = c * math.cos(turn) - s * math.sin(turn), s * math.cos(turn) + c * math.sin(turn)
            step = 0.05 * sign
            assert on_a_line(crossing.x + step * along[0], crossing.y + step * along[1]) == 1


def test_the_field_is_the_same_seen_from_both_goals() -> None:
    def rounded(points: list[tuple[float, ...]]) -> set[tuple[float, ...]]:
        return {tuple(round(value, 9) + 0.0 for value in point) for point in points}

    corners = [corner for marking in FIELD.markings() for corner in marking.corners()]
    assert rounded(corners) == rounded([(-x, -y) for x, y in corners])
    posts = FIELD.posts(GOALS)
    assert rounded(list(posts)) == rounded([(-x, -y) for x, y in posts])


def test_painted_lines_cover_the_corner_and_have_their_width() -> None:
    edge = 4.5 + 0.025
    corners = [corner for marking in FIELD.markings() for corner in marking.corners()]
    assert max(x for x, _ in corners) == pytest.approx(edge)
    assert max(y for _, y in corners) == pytest.approx(3.025)
    for marking in FIELD.markings():
        assert marking.width == 0.05


def test_what_has_length_0_is_left_out() -> None:
    plain = Field(
        goal_area_length=0.0, penalty_area_length=0.0, penalty_mark=0.0, circle_diameter=0.0
    )
    assert len(plain.lines()) == 5
    assert plain.marks() == ((0.0, 0.0),)
    assert {c.kind for c in plain.crossings()} == {CrossingKind.L, CrossingKind.T}


@pytest.mark.parametrize(
    ("ball", "place"),
    [
        ((0.0, 0.0, 0.05), BallPlace.IN_PLAY),
        ((4.57, 2.0, 0.05), BallPlace.IN_PLAY),  # a part of it is over the line
        ((4.58, 2.0, 0.05), BallPlace.OUT),
        ((1.0, 3.074, 0.05), BallPlace.IN_PLAY),
        ((1.0, -3.076, 0.05), BallPlace.OUT),
        ((4.57, 0.0, 0.05), BallPlace.IN_PLAY),
        ((4.58, 0.0, 0.05), BallPlace.IN_BLUE_GOAL),
        ((-4.58, 0.74, 0.05), BallPlace.IN_RED_GOAL),
        ((-4.58, 0.76, 0.05), BallPlace.OUT),
        ((4.58, 0.0, 0.81), BallPlace.OUT),  # over the bar
        ((5.2, 0.0, 0.05), BallPlace.OUT),  # behind the net
    ],
)
def test_place_of_the_ball(ball: tuple[float, float, float], place: BallPlace) -> None:
    assert FIELD.place_of(ball, 0.05, GOALS) is place
    if place in (BallPlace.IN_RED_GOAL, BallPlace.IN_BLUE_GOAL):
        assert FIELD.place_of(ball, 0.05, None) is BallPlace.OUT


def test_lengths_that_do_not_fit_are_named() -> None:
    assert not list(faults(FIELD, GOALS))
    small = Field(length=3.0, width=2.0)
    assert [key for key, _, _ in faults(small, Goals(width=1.9))] == [
        "field.goal_area_width",
        "field.penalty_area_length",
        "field.penalty_area_width",
        "goals.width",
    ]
