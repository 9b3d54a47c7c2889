"""What long work shows of itself."""

import io
import re

import pytest

from sim_bridge.trials import progress
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.progress import Progress


def shown(monkeypatch: pytest.MonkeyPatch, every: float) -> str:
    stream = io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setattr(progress, "EVERY", every)
    parallel_map(abs, [-1, -2, -3], jobs=1, label="walks", note=str)
    with Progress(total=600.0, desc="match") as bar:
        bar.update(90.4)
    return stream.getvalue()


def test_where_no_terminal_is_a_line_comes_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = shown(monkeypatch, 1e-9).splitlines()
    assert re.fullmatch(r"walks: 1 of 3, 00:00 passed, .* left, 1", lines[0])
    assert [line.split(",")[0] for line in lines] == [
        "walks: 1 of 3", "walks: 2 of 3", "walks: 3 of 3", "match: 90 of 600"
    ]  # fmt: skip


def test_work_of_less_than_a_minute_shows_none(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, progress.EVERY) == ""


def test_it_can_be_silent(capfd: pytest.CaptureFixture[str]) -> None:
    with Progress(total=1, show=False) as bar:
        bar.update()
    assert capfd.readouterr().err == ""
