"""Eyes in other processes see what eyes in the process of the match see."""

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("cv2")

from gait_lab.cli import main
from gait_lab.soccer.match import Match, MatchSpec

SECONDS = 0.8


def believed(eyes: int) -> list[object]:
    """What the robots believe at each moment."""
    spec = MatchSpec(seed=3, robots=1)
    told = []
    with Match(spec, rendered=True, eyes=eyes) as match:
        for frame in match.play():
            told.append((frame.time, [(r.believed, r.ball, r.x) for r in frame.robots.values()]))
            if frame.time > SECONDS:
                return told
    raise AssertionError("the match is too short")


def test_eyes_in_another_process_see_the_same() -> None:
    alone, shared = believed(0), believed(1)
    assert shared == alone
    first, last = alone[0], alone[-1]
    assert first != last


@pytest.mark.parametrize(
    "words",
    [("--eyes", "-1"), ("--eyes", "1", "--vision", "model"), ("--eyes", "1", "--real-time")],
    ids=["fewer than none", "model", "real time"],
)
def test_eyes_that_cannot_be_are_refused(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["match", *words]) == 2
    assert "--eyes" in capsys.readouterr().err


def test_an_engine_that_cannot_tell_its_picture_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("pybullet")
    words = ["match", "--eyes", "1", "--engine", "pybullet", "--minutes", "0.1", "--robots", "1"]
    assert main(words) == 2
    assert "engine: got 'pybullet'" in capsys.readouterr().err
