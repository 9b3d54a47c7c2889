"""Bags that lack something: a clear word about what is missing, and a report of what is there."""

import ast
import dataclasses
import json
import math
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("mujoco")
pytest.importorskip("plotly")

from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import String

from gait_lab import cli
from gait_lab.analysis.bag import TYPES, BagWriter, open_bag
from gait_lab.analysis.recorded_topics import PARTS, find_parts, missing_parts
from gait_lab.report.analysis import Analysis, analyse
from gait_lab.report.command import report_page
from gait_lab.report.verdict import findings, headline
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec
from sim_bridge.trials.tasks import TASKS, Task
from sim_bridge.trials.trial import Push
from walk_bag import write_walk

BRIEF = Task("forward", ((1.0, STANDSTILL), (1.5, VelocityCommand(0.3))), 2.0, 4.0, "x")
SPEC = RolloutSpec(task=BRIEF, engine="mujoco", robot_seed=1)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_walk(tmp_path_factory.mktemp("walk") / "bag", SPEC).bag


def report(bag: Path, page: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    """Exit status, words in the terminal, page."""
    status = cli.main(["report", str(bag), "-o", str(page)])
    out = capsys.readouterr()
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    return status, out.out + out.err, text


def figures_of(page: str) -> set[str]:
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert data is not None
    return {figure["id"] for figure in json.loads(data[1].replace("<\\/", "</"))["figures"]}


ALL = {"speeds", "com", "path", "odometry", "steps", "origins", "innovation", "whiteness",
       "joints", "torques", "motors", "torso", "loads", "timing"}  # fmt: skip


def test_a_whole_bag_gives_every_figure(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, words, page = report(whole, tmp_path / "r.html", capsys)
    assert status == 0
    assert "lacks" not in words
    assert figures_of(page) == ALL
    assert len(page.encode()) < 15e6
    assert not re.search(r'<(script|link|img)[^>]+(src|href)="(?!data:)', page), "no network"


@pytest.mark.parametrize(
    ("part", "gone"),
    [
        ("truth", {"odometry", "torso"}),
        ("joints", {"joints", "torques", "motors", "timing", "odometry"}),
        ("targets", set()),
        ("command", set()),
        ("odometry", {"odometry"}),
        ("expected", {"innovation", "whiteness"}),
        ("footsteps", {"origins"}),
        ("support", {"steps", "origins"}),
        ("left_sole", {"loads"}),
        ("diagnostics", set()),
    ],
)
def test_a_topic_that_is_missing_costs_its_part_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], part: str, gone: set[str]
) -> None:
    topic = PARTS[part].topic
    write_walk(tmp_path / "bag", SPEC, without={topic})
    status, words, page = report(tmp_path / "bag", tmp_path / "r.html", capsys)
    assert status == 0
    assert f"lacks {topic} (" in words
    assert topic in page.split("Not in this bag")[1]
    assert figures_of(page) == ALL - gone


def test_only_sensors_are_still_a_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    others = {part.topic for name, part in PARTS.items() if name not in ("joints", "clock")}
    write_walk(tmp_path / "bag", SPEC, without=others)
    status, words, page = report(tmp_path / "bag", tmp_path / "r.html", capsys)
    assert status == 0
    assert "whether the robot walked is not in the bag" in words
    assert figures_of(page) == {"joints", "torques", "motors", "timing"}


def test_without_ground_truth_speeds_come_from_odometry(whole: Path, tmp_path: Path) -> None:
    write_walk(tmp_path / "bag", SPEC, without={"/ground_truth/odom", "/ground_truth/com"})
    true, own = analyse(whole), analyse(tmp_path / "bag")
    assert true.walking is not None
    assert own.walking is not None
    assert own.walking.speed_x == pytest.approx(true.walking.speed_x, abs=0.04)
    assert own.body is not None
    assert not own.body.from_truth
    # The torso stands over flat soles, as high as it really is.
    height = own.body.torso[:, 2, 3]
    assert true.body is not None
    assert np.nanmedian(height) == pytest.approx(np.nanmedian(true.body.torso[:, 2, 3]), abs=0.01)


def test_no_finding_without_its_data(whole: Path, tmp_path: Path) -> None:
    write_walk(tmp_path / "bag", SPEC, without={"/l_sole/wrench", "/r_sole/wrench"})
    hops = [[each for each in findings(analyse(bag)) if "hop" in each.text]
            for bag in (whole, tmp_path / "bag")]  # fmt: skip
    assert len(hops[0]) == 1
    assert hops[1] == []
    stood = dataclasses.replace(analyse(whole), phases=())
    assert not any("hop" in each.text for each in findings(stood))


def test_words_of_a_bag_are_no_markup(whole: Path) -> None:
    broken = dataclasses.replace(analyse(whole), robot=None, robot_remark="<img src=x>")
    page = report_page(broken)
    assert "<img src=x>" not in page
    assert "&lt;img src=x&gt;" in page


def test_a_namespace_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_walk(tmp_path / "bag", SPEC, prefix="/nao7")
    status, words, page = report(tmp_path / "bag", tmp_path / "r.html", capsys)
    assert status == 0
    assert "lacks" not in words
    assert figures_of(page) == ALL


def test_a_truncated_bag_is_reported_as_far_as_it_goes(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(whole, tmp_path / "bag")
    file = tmp_path / "bag" / "bag.mcap"
    os.truncate(file, file.stat().st_size * 7 // 10)
    status, words, page = report(tmp_path / "bag", tmp_path / "r.html", capsys)
    assert status == 0
    assert "breaks off after" in words
    assert "breaks off after" in page
    assert 1.0 < analyse(tmp_path / "bag").walk.duration < 5.9


def test_a_bag_without_metadata_is_reported(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(whole, tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").unlink()
    status, words, page = report(tmp_path / "bag", tmp_path / "r.html", capsys)
    assert status == 0
    assert "metadata.yaml is missing" in words
    assert figures_of(page) == ALL


def test_an_empty_and_a_foreign_bag_say_what_they_hold(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with BagWriter(tmp_path / "empty"):
        pass
    status, words, page = report(tmp_path / "empty", tmp_path / "e.html", capsys)
    assert status == 1
    assert "Nothing of a walk is in this bag" in words
    assert "lacks" not in words
    assert "Nothing of a walk" in page
    assert figures_of(page) == set()
    serialize = pytest.importorskip("rclpy.serialization").serialize_message
    with BagWriter(tmp_path / "foreign") as writer:
        writer.add_topic("/chatter", "std_msgs/msg/String")
        writer.write("/chatter", 1, serialize(String(data="</script><b>&")))
    status, words, page = report(tmp_path / "foreign", tmp_path / "f.html", capsys)
    assert status == 1
    assert "Its topics: /chatter" in words
    assert "lacks /joint_states (sensor_msgs/msg/JointState)" in words
    assert "/chatter" in page


def test_what_is_no_bag_is_a_usage_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, words, _ = report(tmp_path / "nowhere", tmp_path / "r.html", capsys)
    assert status == 2
    assert "does not exist" in words
    assert "rosbag2" in words
    assert not (tmp_path / "r.html").exists()


def altered(
    bag: Path, out: Path, only: set[str] | None = None, longest: float = math.inf,
    alter: Callable[[str, Any], object] = lambda topic, message: None,
) -> Path:  # fmt: skip
    """The bag with only these topics, so many seconds, and messages that are altered in place."""
    found = open_bag(bag)
    rows = [
        (log, topic, message)
        for topic, messages in found.messages.items() if only is None or topic in only
        for log, message in messages
    ]  # fmt: skip
    rows.sort(key=lambda row: row[0])
    with BagWriter(out) as writer:
        for topic in {topic for _, topic, _ in rows}:
            writer.add_topic(topic, found.topics[topic].type)
        for log, topic, message in rows:
            if log - rows[0][0] <= 1e9 * longest:
                alter(topic, message)
                data = TYPES.serialize_cdr(message, found.topics[topic].type)
                writer.write(topic, log, bytes(data))
    return out


def clear_stamps(_topic: str, message: Any) -> None:
    for part in (message, *getattr(message, "markers", ())):
        stamp = getattr(getattr(part, "header", None), "stamp", None)
        if stamp is not None:
            object.__setattr__(stamp, "sec", 0)
            object.__setattr__(stamp, "nanosec", 0)


def said(bag: Path) -> str:
    analysis = analyse(bag)
    return "\n".join(each.text for each in (headline(analysis), *findings(analysis)))


def test_odometry_and_commands_alone_say_nothing_of_hops_falls_and_joints(
    whole: Path, tmp_path: Path
) -> None:
    words = said(altered(whole, tmp_path / "bag", {"/odom", "/cmd_vel"}))
    assert "whether the robot walked is not in the bag" in words
    assert not re.search("hop|fall|torque|Timing|CoM|Odometry ends", words)
    assert "by odometry" in words


@pytest.mark.parametrize("longest", [0.0, 0.02, 0.05, 0.3])
def test_a_moment_is_no_verdict(whole: Path, tmp_path: Path, longest: float) -> None:
    analysis = analyse(altered(whole, tmp_path / "bag", longest=longest))
    assert findings(analysis) == ()
    assert headline(analysis).grade not in ("good", "fair")


def test_a_robot_that_stood_neither_walks_nor_hops(tmp_path: Path) -> None:
    stand = RolloutSpec(task=TASKS["stand"].lasting(1.0), engine="mujoco", robot_seed=1)
    words = said(write_walk(tmp_path / "bag", stand).bag)
    assert "did not walk" in words
    assert not re.search("hop|Odometry|walks|speeds were reached|Steps took", words)


def test_without_stamps_the_time_of_arrival_counts(whole: Path, tmp_path: Path) -> None:
    topics = {"/joint_states", "/odom", "/cmd_vel", "/gait/support", "/joint_command"}
    words = said(altered(whole, tmp_path / "bag", topics, alter=clear_stamps))
    assert "The robot walked for" in words
    assert " ms old" not in words
    assert "Timing: 100 Hz" in words


def rewritten(
    bag: Path, out: Path, step: float, share: float, storage: str, start: int = 10**18
) -> Path:
    """The bag in wall time, on a clock that steps by so many seconds after a share of the time."""
    found = open_bag(bag)
    rows = sorted(
        (
            (log, topic, message)
            for topic, messages in found.messages.items() if topic != "/clock"
            for log, message in messages
        ),
        key=lambda row: row[0],
    )  # fmt: skip
    moment = rows[0][0] + share * (rows[-1][0] - rows[0][0])
    with BagWriter(out, storage) as writer:
        for topic, each in found.topics.items():
            if topic != "/clock":
                writer.add_topic(topic, each.type)
        for log, topic, message in rows:
            shift = start + (round(1e9 * step) if log >= moment else 0)
            for part in (message, *getattr(message, "markers", ())):
                stamp = getattr(getattr(part, "header", None), "stamp", None)
                if stamp is not None:
                    time = stamp.sec * 10**9 + stamp.nanosec + shift
                    object.__setattr__(stamp, "sec", time // 10**9)
                    object.__setattr__(stamp, "nanosec", time % 10**9)
            data = TYPES.serialize_cdr(message, found.topics[topic].type)
            writer.write(topic, log + shift, bytes(data))
    return out


@pytest.fixture(scope="module")
def never(whole: Path) -> Analysis:
    """Of the same bag in wall time, on a clock that does not step."""
    return analyse(rewritten(whole, whole.parent / "never", 0.0, 0.5, "mcap"))


@pytest.mark.parametrize(
    ("step", "share", "storage"),
    [(-30.0, 0.4, "mcap"), (-2.0, 0.6, "mcap"), (-1.0, 0.7, "mcap"), (3600.0, 0.3, "mcap"),
     (3600.0, 0.7, "sqlite3")],
)  # fmt: skip
def test_one_side_of_a_clock_that_steps_is_reported(
    whole: Path, never: Analysis, tmp_path: Path, step: float, share: float, storage: str
) -> None:
    stepped = analyse(rewritten(whole, tmp_path / "stepped", step, share, storage))
    assert never.walk.step == ""
    part = max(share, 1.0 - share)
    assert stepped.walk.duration == pytest.approx(part * never.walk.duration, abs=0.1)
    assert f"the clock steps by {step:+.1f} s" in headline(stepped).text
    used = re.search(r"(\d+) % of /joint_states", headline(stepped).text)
    assert used is not None
    assert int(used[1]) == pytest.approx(100 * part, abs=1.5), "the first readings come late"
    assert len(stepped.steps) <= len(never.steps)
    assert stepped.robot is not None
    assert stepped.walk.urdf == never.walk.urdf, "what is latched is kept"
    inside = np.isin(stepped.walk.position.value, never.walk.position.value).all()
    assert inside, "joint angles of one side only"


LATIN = {"PYTHONIOENCODING": "iso-8859-1"}
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


@pytest.mark.parametrize("locale", [LATIN, ASCII, {"PYTHONIOENCODING": "ascii"}])
def test_the_terminal_may_have_any_encoding(
    whole: Path, tmp_path: Path, locale: dict[str, str]
) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "gait_lab.cli", "report", str(whole), "-o", str(tmp_path / "r")],
        env={**os.environ, **locale}, capture_output=True, check=False,
    )  # fmt: skip
    words = done.stdout.decode("iso-8859-1")
    assert (done.returncode, done.stderr) == (0, b"")
    assert "The robot walked for" in words
    assert "\\u" not in words
    assert "mean |expected - measured|" in words, "the minus sign, U+2212, is in none of them"


@pytest.mark.parametrize(
    ("words", "environment"),
    [
        (["report", "{bag}", "-o", "/proc/r.html"], {}),
        (["report", "{bag}", "-o", "/dev/null/r.html"], {}),
        (["record", "/proc/bag", "--duration", "1"], {}),
        (["record", "{new}", "--duration", "1"], {"ROS_LOG_DIR": "/proc/log"}),
        (["demo", "--out", "/proc/demo"], {}),
        (["teach", "check", "/dev/zero"], {}),
    ],
)
def test_places_that_cannot_be_written_are_one_line(
    whole: Path, tmp_path: Path, words: list[str], environment: dict[str, str]
) -> None:
    given = [word.format(bag=whole, new=tmp_path / "new") for word in words]
    done = subprocess.run(
        [sys.executable, "-m", "gait_lab.cli", *given], env={**os.environ, **environment},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"nao_gait {words[0]}: ")
    assert done.returncode in (1, 2)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_messages_that_are_not_used_cost_no_memory(
    whole: Path, tmp_path: Path, storage: str
) -> None:
    size, count = 10**6, 100
    image, cloud = Image(data=bytes(size)), PointCloud2(data=bytes(size))
    found = open_bag(whole)
    with BagWriter(tmp_path / "bag", storage) as writer:
        writer.add_topic("/camera/image_raw", "sensor_msgs/msg/Image")
        writer.add_topic("/lidar/points", "sensor_msgs/msg/PointCloud2")
        for topic, each in found.topics.items():
            writer.add_topic(topic, each.type)
            for log, message in found.messages[topic]:
                data = TYPES.serialize_cdr(message, each.type)
                writer.write(topic, log, bytes(data))
        for n in range(count // 2):
            writer.write("/camera/image_raw", n * 10**7, serialize_message(image))
            writer.write("/lidar/points", n * 10**7, serialize_message(cloud))
    # Not ru_maxrss, which a process inherits from the one that starts it.
    script = (
        "import re, sys; from pathlib import Path\n"
        "from gait_lab.report.analysis import analyse\n"
        "status = Path('/proc/self/status')\n"
        "most = lambda: int(re.search('VmHWM:(.*) kB', status.read_text())[1])\n"
        "print([(len(analyse(Path(bag)).steps), most()) for bag in sys.argv[1:]])"
    )
    bags = str(whole), str(tmp_path / "bag")
    done = subprocess.run([sys.executable, "-c", script, *bags], capture_output=True, text=True,
                          check=True)  # fmt: skip
    (steps, before), (same, after) = ast.literal_eval(done.stdout)
    assert same == steps
    assert after - before < 30 * 1024, "kilobytes, of a hundred megabytes"


def test_a_push_and_a_fall_are_found(tmp_path: Path) -> None:
    push = Push(time=3.0, impulse=12.0, direction=np.pi / 2)
    spec = RolloutSpec(task=SPEC.task, engine="mujoco", robot_seed=1, push=push)
    written = write_walk(tmp_path / "bag", spec)
    assert written.metrics.fell
    assert written.metrics.fall_time is not None
    analysis = analyse(tmp_path / "bag")
    kinds = [event.kind for event in analysis.events]
    assert "push" in kinds
    assert "fall" in kinds
    assert analysis.fall == pytest.approx(written.metrics.fall_time)
    assert "fell after" in headline(analysis).text
    assert any("0 of 1 pushes" in finding.text for finding in findings(analysis))


def test_names_of_topics_decide_before_their_ends() -> None:
    from gait_lab.analysis.bag import TopicSummary

    joints = TopicSummary("sensor_msgs/msg/JointState", 5)
    odometry = TopicSummary("nav_msgs/msg/Odometry", 5)
    parts = find_parts({"/a/joint_states": joints, "/b/joint_states": joints,
                        "/a/ground_truth/odom": odometry, "/a/odom": odometry})  # fmt: skip
    assert "joints" not in parts, "two robots: which one is not ours to guess"
    assert parts["truth"] == "/a/ground_truth/odom"
    assert parts["odometry"] == "/a/odom"
    assert find_parts({"/odom": joints}) == {}
    assert len(missing_parts({})) == sum(not part.optional for part in PARTS.values())


def test_two_bags_are_compared(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = RolloutSpec(task=SPEC.task, engine="mujoco", robot_seed=2)
    write_walk(tmp_path / "other", other)
    page = tmp_path / "c.html"
    assert cli.main(["report", str(whole), str(tmp_path / "other"), "-o", str(page)]) == 0
    words = capsys.readouterr().out
    assert "From A to B" in words
    text = page.read_text(encoding="utf-8")
    assert {"speeds", "reached", "durations", "origins", "whiteness"} <= figures_of(text)
    assert 'class="better"' in text or 'class="worse"' in text


def test_a_bag_compared_with_itself_shows_no_difference(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["report", str(whole), str(whole), "-o", str(tmp_path / "c.html")]) == 0
    assert "No number differs" in capsys.readouterr().out
    text = (tmp_path / "c.html").read_text(encoding="utf-8")
    assert 'class="better"' not in text
    assert 'class="worse"' not in text
