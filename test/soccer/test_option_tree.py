"""The engine of options: transitions, times, paths, and what it refuses."""

from pathlib import Path

import pytest

from nao_soccer.behavior.option_tree import (
    Activation,
    After,
    Option,
    OptionTree,
    State,
    When,
    mermaid,
)
from nao_soccer.behavior.options import PLAYER
from robot_core.errors import NaoGaitError


def hot(value: float) -> bool:
    return value > 0.0


def cold(value: float) -> bool:
    return value < 0.0


def rest(value: float) -> str:
    return "rest"


def run(value: float) -> str:
    return "run"


def tree() -> Option[float, str]:
    inner: Option[float, str] = Option(
        "inner",
        State("first", rest, [After(1.0, "second")]),
        State("second", run, [After(1.0, "first")]),
    )
    return Option(
        "root",
        State("wait", rest, [When(hot, "work")]),
        State("work", inner, [When(cold, "wait")]),
    )


def test_the_first_state_is_the_initial_one_and_symbols_move_on() -> None:
    engine = OptionTree(tree())
    action, path = engine.update(0.0, 10.0)
    assert (action, [each.state for each in path]) == ("rest", ["wait"])
    action, path = engine.update(1.0, 10.1)
    assert [(each.option, each.state) for each in path] == [("root", "work"), ("inner", "first")]


def test_the_path_has_the_time_in_each_state() -> None:
    engine = OptionTree(tree())
    for step in range(1, 26):
        _, path = engine.update(1.0, 0.1 * step)
    assert [each.state for each in path] == ["work", "first"]
    assert path[0].seconds == pytest.approx(2.4)
    assert path[1].seconds == pytest.approx(0.4)


def test_the_path_tells_the_transition_that_led_to_a_state() -> None:
    engine = OptionTree(tree())
    assert engine.update(0.0, 10.0)[1][0][3:] == ("", "")
    for time in (10.1, 10.3):
        _, path = engine.update(1.0, time)
        assert path[0].left == "wait"
        assert path[0].why == engine.root.states["wait"].to[0].label
        assert path[1].left == ""
    for each in path:
        assert Activation.parsed(str(each)) == each._replace(seconds=round(each.seconds, 1))


def test_at_most_one_transition_of_an_option_is_taken_per_update() -> None:
    option: Option[float, str] = Option(
        "chain",
        State("a", rest, [After(0.0, "b")]),
        State("b", rest, [After(0.0, "c")]),
        State("c", run, [After(9.0, "a")]),
    )
    engine = OptionTree(option)
    assert [engine.update(0.0, 0.1 * i)[1][0].state for i in range(3)] == ["b", "c", "c"]


def test_an_option_that_was_left_starts_again_in_its_first_state() -> None:
    engine = OptionTree(tree())
    engine.update(1.0, 0.0)
    assert engine.update(1.0, 1.5)[1][1].state == "second"
    engine.update(-1.0, 1.6)
    assert engine.update(1.0, 1.7)[1][1].state == "first"


@pytest.mark.parametrize(
    ("states", "message"),
    [
        ([], "no states"),
        ([State("a", rest, [When(hot, "b")]), State("b", rest)], "no way out"),
        ([State("a", rest, [When(hot, "a")]), State("b", rest, [When(hot, "a")])], "no way out"),
        ([State("a", rest, [When(hot, "c")]), State("b", rest, [When(hot, "a")])], "'c'"),
        (
            [
                State("a", rest, [When(hot, "b")]),
                State("b", rest, [When(hot, "a")]),
                State("lost", rest, [When(hot, "a")]),
            ],
            "never reached",
        ),
        ([State("a", rest, [After(1.0, "b")]), State("a", rest, [After(1.0, "a")])], "once"),
    ],
)
def test_an_option_without_a_way_through_is_refused(
    states: list[State[float, str]], message: str
) -> None:
    with pytest.raises(NaoGaitError, match=message):
        Option("broken", *states)


def test_an_option_that_contains_itself_is_refused() -> None:
    option = tree()
    option.states["wait"].do = option
    with pytest.raises(NaoGaitError, match="contains itself"):
        OptionTree(option)


def test_the_picture_shows_every_state_and_transition_of_the_player() -> None:
    picture = mermaid(PLAYER)
    assert picture.startswith("stateDiagram-v2\n")
    for text in ("play the ball__dribble", "striker__search", "keeper__dive_left", "after 1.5 s"):
        assert text.replace(" ", "_") in picture.replace(" ", "_")
    assert picture.count("{\n") == picture.count("  }\n")


def test_the_picture_in_the_docs_is_that_of_the_code() -> None:
    text = (Path(__file__).parents[2] / "docs" / "behavior.mmd").read_text(encoding="utf-8")
    assert mermaid(PLAYER) == text
