"""Every option of every command: what it may not be ends in a line that names it, before any work.

The options are found in the tables of the commands; nothing here knows one of them by name.
"""

import argparse
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gait_lab import cli
from gait_lab.bench import registry
from gait_lab.bench.options import Option, Options
from gait_lab.command_line import Argument, Command, argument
from gait_lab.demo.node_processes import empty_folder
from robot_core.errors import NaoGaitError
from robot_core.schema import Choice, Kind, Number, require_writable, write_text

LONGEST = 3000
"""[characters] of a line."""
NUMBERS = ("", "abc", "nan", "-nan", "inf", "1e999", "0x10", "1,5", "9" * 5000, "x" * 5000)
WORDS = ("", " ", "nothing", "\u00fc", "a\nb", "\x1b[2J", "x" * 5000)


def commands(table: dict[str, Command]) -> Iterator[tuple[tuple[str, ...], Command]]:
    """Words and declaration of each command that is a table."""
    for name, each in table.items():
        if each.run:
            yield (name,), each
        for words, part in commands(each.parts):
            yield (name, *words), part


ALL = [(words, each) for words, command in commands(cli.COMMANDS) for each in command.arguments]
NAMES = [" ".join((*words, each.flags[-1])) for words, each in ALL]


def wrong(kind: Kind) -> Iterator[str]:
    """Words that a kind does not allow."""
    if isinstance(kind, Number):
        yield from NUMBERS
        yield from (f"{end:.17g}" for end in (kind.minimum - 1.0, kind.maximum * 2.0 + 1.0))
        yield from ("1.5", "0.0") if kind.whole else ()
    elif isinstance(kind, Choice):
        yield from WORDS
    else:
        yield from WORDS[:2]


def line(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command that must be refused; its line."""
    try:
        status = cli.main(words)
    except SystemExit as stop:  # argparse
        status = int(stop.code or 0)
    assert status == cli.EXIT_USAGE
    text = capsys.readouterr().err
    assert len(text) < LONGEST
    assert text.count("\n") == 1
    assert text.rstrip("\n").isprintable()
    return text


def given(words: tuple[str, ...], each: Argument, word: str, folder: Path) -> tuple[str, ...]:
    """A command line with this word for an argument, and any for what else it needs."""
    (command,) = (known for name, known in commands(cli.COMMANDS) if name == words)
    line = list(words)
    for other in command.arguments:
        option, count = other.flags[-1].startswith("-"), other.options.get("nargs", 1)
        needed = other.options.get("required") if option else count not in ("?", "*")
        if other is not each and not needed:
            continue
        text = word if other is each else str(folder / "other.yaml")
        if not option:
            line.append(text)
        elif isinstance(count, int) and count > 1:
            line += [other.flags[-1], text, *["0"] * (count - 1)]
        else:
            line.append(f"{other.flags[-1]}={text}")
    return tuple(line)


def test_numbers_and_choices_are_declared_as_kinds() -> None:
    taken = {"action", "const", "default", "dest", "help", "metavar", "nargs", "required", "type"}
    for name, (_, each) in zip(NAMES, ALL, strict=True):
        assert set(each.options) <= taken, name
        assert each.options.get("type", Path) is Path, name


@pytest.mark.parametrize(("words", "each"), ALL, ids=NAMES)
def test_a_wrong_word_is_refused_in_a_line_that_names_the_option(
    words: tuple[str, ...], each: Argument, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = each.writes or each.options.get("type") is Path
    for word in WORDS[:2] if path else wrong(each.kind) if each.kind is not None else ():
        if "nargs" in each.options and word.startswith("-"):
            continue  # argparse takes it for an option
        text = line(given(words, each, word, tmp_path), capsys)
        named = each.flags[-1] if each.flags[-1].startswith("-") else each.options["metavar"]
        assert f"{named}: got " in text
        assert "; allowed: " in text


@pytest.mark.parametrize(
    ("words", "each"), [pair for pair in ALL if pair[1].writes],
    ids=[name for name, (_, each) in zip(NAMES, ALL, strict=True) if each.writes],
)  # fmt: skip
def test_what_cannot_be_written_is_said_before_the_work(
    words: tuple[str, ...], each: Argument, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("gait_lab.command_line.import_module", pytest.fail)  # the work
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder").mkdir()
    other = "file" if each.writes == "folder" else "folder"
    before = sorted(tmp_path.rglob("*"))
    for place in (tmp_path / "file" / "below", tmp_path / ("x" * 300), tmp_path / other):
        text = line(given(words, each, str(place), tmp_path), capsys)
        assert f"{each.flags[-1]}: got " in text
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text() == "kept"


SUITES = [(suite.name, name, each) for suite in registry.suites().values()
          for name, each in suite.options.items() if each.metavar]  # fmt: skip


def read(each: Option, word: str) -> Any:
    return (each.read(word),) if each.repeated else each.read(word)


@pytest.mark.parametrize(
    ("suite", "name", "each"), SUITES, ids=[f"{suite} {name}" for suite, name, _ in SUITES]
)
def test_a_wrong_number_of_a_suite_is_refused(suite: str, name: str, each: Option) -> None:
    kind = each._kind
    for word in wrong(kind) if isinstance(kind, Number | Choice) else ():
        with pytest.raises(NaoGaitError) as refused:
            Options.of({name: each}, {name: read(each, word)})
        assert refused.value.field == each.flags[0].lstrip("-")
        assert len(str(refused.value)) < LONGEST


ROBOT, PLANT, PRESET = ("--robot",), ("--plant",), ("--preset",)
RESOURCES = {
    "demo": (*ROBOT, *PLANT, *PRESET, "--tour"), "match": ("--scene",), "rcss": (*ROBOT, *PRESET),
    "teach list": ROBOT, "write kicks --out=new.yaml": ROBOT, "write ros2_control": ROBOT,
    "tune speed": (*ROBOT, "--method", "--confirm-on"), "bench speed": (*ROBOT, *PLANT, *PRESET),
    "bench ball": ("--scene",),
}  # fmt: skip
"""Commands, and options that name something that is shipped, or a file of it."""


@pytest.fixture
def no_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is simulated, started or connected to: an accepted word fails the test."""
    for place in (
        "sim_bridge.world.World.step", "subprocess.Popen.__init__", "socket.socket.connect",
        "multiprocessing.process.BaseProcess.start", "robot_core.ros.process.DomainClaim.__init__",
    ):  # fmt: skip
        monkeypatch.setattr(place, lambda *_, **__: pytest.fail("accepted"))


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize(
    ("words", "flag"), [(words, flag) for words, flags in RESOURCES.items() for flag in flags]
)
def test_an_unknown_name_or_foreign_file_is_refused(
    words: str, flag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "binary").write_bytes(bytes(range(256)))
    (tmp_path / "list.yaml").write_text("[1, 2]")
    for word in (*WORDS, "/dev/zero", "./missing.yaml", "./folder", "./binary", "./list.yaml"):
        text = line((*words.split(), f"{flag}={word}"), capsys)
        assert " allowed: " in text


def test_an_argument_that_is_not_utf8_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert "UTF-8" in line(("view", "--namespace", os.fsdecode(b"\xff")), capsys)


# -- files -----------------------------------------------------------------------------------------


def test_a_device_pipe_or_link_is_written_to_and_stays_what_it_is(tmp_path: Path) -> None:
    pipe, file, link = (tmp_path / name for name in ("pipe", "file", "link"))
    os.mkfifo(pipe)
    link.symlink_to(file)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_text(pipe, "text", "out")
        assert os.read(reader, 99) == b"text"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    write_text(link, "text", "out")
    assert link.is_symlink()
    assert file.read_text() == "text"
    with pytest.raises(NaoGaitError, match=r"out: got .*a file that can be written"):
        write_text(tmp_path, "text", "out")


def test_trying_a_file_leaves_everything_as_it_was(tmp_path: Path) -> None:
    require_writable(tmp_path / "a" / "b" / "new", "out")
    require_writable(tmp_path / "a" / "new", "out", folder=True)
    require_writable(tmp_path, "out", folder=True)
    assert not list(tmp_path.iterdir())


def test_a_new_run_removes_only_what_the_last_one_wrote(tmp_path: Path) -> None:
    for name in ("photo.png", "report.html", "notes.log", "bag/bag.mcap", "bag/metadata.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    empty_folder(tmp_path, "report.html")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["notes.log", "photo.png"]
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "receipt.txt").touch()
    with pytest.raises(NaoGaitError, match="out: got"):
        empty_folder(tmp_path, "report.html")
    assert (tmp_path / "bag" / "receipt.txt").exists()


def test_a_new_kind_of_option_is_found_by_these_tests() -> None:
    parser = argparse.ArgumentParser()
    added: Any = argument("--n", kind=Number(1, 9, whole=True), help="").add_to(parser)
    assert parser.parse_args(["--n", "9"]).n == 9
    assert added.dest == "n"
