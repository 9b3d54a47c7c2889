"""Files and texts from outside are limited before they are parsed, and again before they are shown.

One process reads hundreds of hostile files, and measures its memory and processor time for each.
"""

import os
import re
import resource
import shutil
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hostile_bags import bags

from gait_lab.analysis.bag import BagWriter, open_bag
from gait_lab.peers.policy_file import load_policy
from gait_lab.report.analysis import analyse
from gait_lab.tune.study import load_study
from nao_lipm_gait.calibration_file import calibration_of, load_calibration
from nao_lipm_gait.parameters import load_preset
from nao_soccer.behavior.kicks import load_kicks
from nao_soccer.vision.colors import load_color_table
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.motion.library import library_of
from robot_core.motion.motion_file import load_motions
from robot_core.resources import share
from robot_core.robot import load_robot
from robot_core.robot.robot_file import checked_robot_file, read_robot_file
from sim_bridge.plant import load_plant
from sim_bridge.scene import load_scene, parse_scene

MEMORY, SECONDS = 300 * 2**20, 2
"""[bytes] that one file may add to what the process holds; [s] of processor time for it."""
LONGEST = 3000
"""[characters] of one refusal."""


def bomb(levels: int, width: int = 9) -> str:
    """YAML whose aliases stand for `width` ** `levels` values."""
    rows = ["a0: &a0 [" + ", ".join("x" * width) + "]"]
    rows += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * width)}]" for n in range(1, levels)]
    return "\n".join(rows)


def under(key: str, text: str) -> str:
    return f"{key}:\n" + "\n".join(f"  {line}" for line in text.splitlines())


TEXTS = {
    "bomb": bomb(9),
    "small bomb": bomb(4),
    "mapping bomb": "a0: &a0 {x: 1}\n" + "".join(
        f"a{n}: &a{n} {{{', '.join(f'k{k}: *a{n - 1}' for k in range(9))}}}\n" for n in range(1, 9)
    ),
    "merged bomb": "a0: &a0 {x: 1}\n" + "".join(
        f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}]}}\n" for n in range(1, 9)
    ),
    "recursive": "&a [*a]",
    "recursive mapping": "&a {meaning: *a, name: *a}",
    "deep list": "[" * 100_000,
    "deep mapping": "{a: " * 50_000,
    "deep block": "- " * 50_000,
    "long text": "meaning: " + "a" * 200_000,
    "long key": "a" * 200_000 + ": 1",
    "many values": "- [" + "1, " * 80_000 + "1]",
    "many keys": "".join(f"k{n}: 1\n" for n in range(20_000)),
    "large": "# nothing\n" * 1_000_000,
    "base 60": "meaning: 1" + ":1" * 4_000,
    "huge integer": "meaning: " + "9" * 9_000,
    "huge hexadecimal": "meaning: 0x" + "f" * 9_000,
    "timestamp": "meaning: !!timestamp never",
    "boolean": "meaning: !!bool maybe",
    "object": "!!python/object/apply:os.system [true]",
    "empty": "",
    "scalar": "3",
    "list": "[1, 2]",
    "nothing": "~",
    "null byte": "a: \0",
    "escape": 'meaning: "\\e[2J\\e[31m"\n"\\e]0;title\\a": 1',
    "two lines": '"a\\nb": "c\\nd"',
    "not a number": "{name: .nan, time: .inf}",
    "two documents": "a: 1\n---\nb: 2",
    "strange key": "? [1, 2]\n: 3",
    "many anchors": "".join(f"- &a{n} x\n" for n in range(30_000)),
}  # fmt: skip
YAML_READERS: dict[str, Callable[[Path], object]] = {
    "plant": lambda path: load_plant(str(path)),
    "scene": load_scene,
    "preset": load_preset,
    "study": lambda path: load_study(str(path)),
    "calibration": lambda path: load_calibration(path, load_robot()),
    "motion": lambda path: load_motions(path, load_robot()),
    "colours": load_color_table,
    "kicks": lambda path: load_kicks(path),
    "robot": lambda path: checked_robot_file(read_robot_file(path), path),
    "policy": lambda path: load_policy(path, load_robot()),
}
"""A file of each kind that the tools and nodes read."""
NAME_READERS: dict[str, Callable[[str], object]] = {
    "robot description": load_robot,
    "motions": lambda name: library_of(load_robot(), name),
    "node's calibration": lambda name: calibration_of(load_robot(), name),
    "bag": lambda name: open_bag(Path(name)),
    "recording": lambda name: analyse(Path(name)),
}
HARMLESS = (
    "preset, empty", "preset, nothing", "motions at ''", "motions at '/'",
    "node's calibration at ''",
)  # fmt: skip
KEYS = {
    "motion": "poses", "scene": "robots", "plant": "physics", "robot": "joints", "study": "places",
}  # fmt: skip


def urdf_texts() -> Iterator[tuple[str, str]]:
    whole = share("urdf", "nao_h21_v33.urdf").read_text()
    end = "</robot>"
    yield "entities", '<!DOCTYPE a [<!ENTITY a "x">]><robot name="a">&a;</robot>'
    yield "deep elements", "<robot name='a'>" + "<link>" * 10_000 + "</link>" * 10_000 + end
    yield "deep elements in a robot", whole.replace(end, "<a>" * 15_000 + "</a>" * 15_000 + end)
    yield "many links", whole.replace(end, "".join(f"<link name='l{n}'/>" for n in range(9_000)))
    yield "more links", "<robot>" + "".join(f"<link name='l{n}'/>" for n in range(99_000)) + end
    yield "a long chain", whole.replace(end, "".join(
        f"<link name='l{n}'/><joint name='j{n}' type='fixed'><parent link='l{n - 1}'/>"
        f"<child link='l{n}'/></joint>" for n in range(9_000)
    ) + end)  # fmt: skip
    yield "a long name", f"<robot name='a'><link name='{'n' * 100_000}'/>{end}"
    yield "long numbers", whole.replace('xyz="', f'xyz="{"9" * 50_000} ', 1)
    yield "large URDF", "<robot>" + " " * 9_000_000 + end
    yield "no robot", "<a/>"
    yield "cut off", whole[: len(whole) // 2]
    yield "no XML", "\x00\x01"


PLACES = (
    "/dev/zero", "/proc/self/mem", "/", "../../../../../../etc/passwd", "http://127.0.0.1:9/a.stl",
    "file:///dev/zero", "package://a/a.stl", "model://a/a.stl", "~nobody/a.stl", "a" * 10_000,
)  # fmt: skip
"""Where nothing is read from, nor is anything fetched."""


def write_meshes(folder: Path) -> None:
    """Meshes that declare, or have, more than fits."""
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    (folder / "huge.stl").write_bytes(bytes(80) + struct.pack("<I", 10**8) + triangle)
    with (folder / "sparse.stl").open("wb") as file:
        file.truncate(2**40)
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    (folder / "faces.obj").write_text(corners + "f 1 2 3\n" * 1_000_000)
    (folder / "far.obj").write_text(corners + "f 1 2 1000000000\n")
    (folder / "huge.msh").write_bytes(struct.pack("<4i", *[10**9] * 4))
    turns = 2.0 * np.pi * np.random.default_rng(0).random((140_000, 3, 2))
    corners = np.stack((np.cos(turns[..., 0]), np.sin(turns[..., 0]), turns[..., 1]), axis=-1)
    solid = np.zeros(len(turns), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("no", "<u2")])
    solid["corners"] = corners
    (folder / "fine.stl").write_bytes(bytes(80) + struct.pack("<I", len(solid)) + solid.tobytes())
    os.mkfifo(folder / "pipe.stl")


def mjcf_texts(folder: Path) -> Iterator[tuple[str, str]]:
    body = "<body name='a'><freejoint/><geom size='1'/></body>"
    geom, end = "<geom size='1'/>", "</worldbody></mujoco>"

    def with_body(more: str = "", beside: str = "") -> str:
        return f"<mujoco>{beside}<worldbody>{body}{more}{end}"

    def with_mesh(file: str, more: str = "") -> str:
        asset = f"{more}<asset><mesh name='m' file='{file}'/></asset>"
        return with_body("<body><geom type='mesh' mesh='m'/></body>", asset)

    for file in (*PLACES, "pipe.stl", "huge.stl", "sparse.stl", "faces.obj", "far.obj", "huge.msh"):
        yield f"a mesh that is {file}", with_mesh(file)
    for count in (1, 2, 40):
        assets = "".join(f"<mesh name='{n}' file='fine.stl'/>" for n in range(count))
        geoms = "".join(f"<geom type='mesh' mesh='{n}'/>" for n in range(count))
        asset = f"<asset>{assets}</asset>"
        yield f"a mesh {count} times", with_body(f"<body>{geoms}</body>", asset)
    yield "a mesh in /dev", with_mesh("zero", "<compiler meshdir='/dev'/>")
    yield "a model in /dev", with_body(beside="<asset><model name='m' file='/dev/zero'/></asset>")
    for size, number in (("memory", "900G"), *((n, "900000000") for n in ("nkey", "nuser_body"))):
        yield size, with_body(beside=f"<size {size}='{number}'/>")
    yield "a sensor", with_body(beside="<sensor><user dim='1000000000'/></sensor>")
    yield "a past", with_body(beside="<sensor><clock nsample='16000000' interval='1'/></sensor>")
    yield "a number", with_body(beside="<custom><numeric name='n' size='1000000000'/></custom>")
    for side, kind in ((100_000, "2d"), (4096, "cube")):
        texture = f"<texture name='t' type='{kind}' builtin='flat' width='{side}' height='{side}'/>"
        yield f"a {kind} texture", with_body(beside=f"<asset>{texture}</asset>")
    yield "copies", with_body(f"<replicate count='100000000' offset='0 0 1'>{geom}</replicate>")
    yield "a grid", with_body("<flexcomp name='f' type='grid' count='2000 2000 200' dim='3'/>")
    heights = "<hfield name='h' nrow='60000' ncol='60000' size='1 1 1 1'/>"
    yield "heights", with_body(beside=f"<asset>{heights}</asset>")
    yield "many bodies", with_body(f"<body>{geom}</body>" * 9_000)
    yield "many geoms", with_body((f"<body>{geom * 20}</body>") * 800)
    yield "deep bodies", with_body(f"<body>{geom}" * 9_000 + "</body>" * 9_000)
    yield "entities in MJCF", f"<!DOCTYPE a [<!ENTITY a 'x'>]>{with_body('&a;')}"
    yield "an endless part", with_body(beside="<include file='/dev/zero'/>")
    yield "itself", with_body(beside=f"<include file='{folder / 'robot.xml'}'/>")
    yield "no part", with_body(beside="<include file='nothing.xml'/>")
    yield "no number", with_body("<body><geom size='x'/></body>")
    yield "no robot in MJCF", with_body()


def hostile(folder: Path) -> Iterator[tuple[str, Callable[[], object]]]:
    """Names and readers of hostile files, each of which is written when it is its turn."""
    for kind, read in YAML_READERS.items():
        for name, text in TEXTS.items():
            path = folder / f"{kind}.yaml"
            path.write_text(text)
            yield f"{kind}, {name}", partial(read, path)
        if kind in KEYS:
            path.write_text(under(KEYS[kind], bomb(9)))
            yield f"{kind}, bomb in {KEYS[kind]}", partial(read, path)
    for name, text in TEXTS.items():
        yield f"scene message, {name}", partial(parse_scene, text)
    path = folder / "robot.urdf"
    for name, text in urdf_texts():
        path.write_text(text)
        yield f"URDF, {name}", partial(load_robot, str(path))
    write_meshes(folder)
    path = folder / "robot.xml"
    for name, text in mjcf_texts(folder):
        path.write_text(text)
        yield f"MJCF, {name}", partial(load_robot, str(path))
    for kind, read in (*YAML_READERS.items(), *NAME_READERS.items()):
        for place in (*PLACES, "", "\0", str(folder / "pipe.stl")):
            yield f"{kind} at {place[:30]!r}", partial(read, place)  # type: ignore[arg-type]
    for name, target in (("device", "/dev/zero"), ("process", "/proc/self/mem"), ("folder", "/")):
        path = folder / "link.yaml"
        path.unlink(missing_ok=True)
        path.symlink_to(target)
        yield name, partial(schema.read_yaml, path, "thing")


VALID = {
    "plant": "plants/worn.yaml", "scene": "scenes/pitch_small.yaml", "preset": "gait/bruno.yaml",
    "study": "studies/speed.yaml", "motion": "motions", "colours": "vision/pitch.yaml",
    "kicks": "kicks", "robot": "robots/nao_v6.yaml",
}  # fmt: skip
ODD = (
    ".nan", ".inf", "-1", "0", "1e308", "-1e-308", "9" * 400, "~", "[]", "{}", "true", "a", '""',
    "[[1]]", "{a: 1}", "0x7fffffffffffffff", "1_000", "2026-01-01", "'\\x00'", "\u202e",
)  # fmt: skip


def mutated(text: str, random: Random) -> str:
    """A valid file in which a few things have been replaced, doubled, moved or cut out."""
    for _ in range(random.choice((1, 1, 2, 5))):
        numbers = list(re.finditer(r"(?<=[ \[,\"])-?\d[\d.e+-]*", text))
        lines = text.splitlines(keepends=True)
        at = random.randrange(len(text) + 1)
        change = random.randrange(7)
        if change < 3 and numbers:
            number = random.choice(numbers)
            text = text[: number.start()] + random.choice(ODD) + text[number.end() :]
        elif change == 3:
            text = text[:at] + text[at + random.choice((1, 3, 30, 1000)) :]
        elif change == 4 and lines:
            line = random.randrange(len(lines))
            lines.insert(random.randrange(len(lines)), lines.pop(line) * random.choice((1, 2, 50)))
            text = "".join(lines)
        elif change == 5:
            odd = random.choice(("{", "]", ":", "&a ", "*a", "\t", "\0", "<", "?"))
            text = text[:at] + odd + text[at:]
        else:
            words = random.randint(1, 9)
            text = re.sub(r"\b[a-z_]{3,}\b", lambda word: word[0][::-1], text, count=words)
    return text


def valid_files(kind: str) -> list[str]:
    """The text of the shipped files of a kind."""
    path = share("config", VALID[kind])
    files = [path] if path.is_file() else sorted(path.rglob("*.yaml"))
    return [file.read_text() for file in files]


def damaged(folder: Path, seeds: int) -> Iterator[tuple[str, Callable[[], object]]]:
    """Names and readers of damaged files of every kind; they may be refused or, by luck, hold."""
    for kind in VALID:
        texts = valid_files(kind)
        for seed in range(seeds):
            path = folder / f"{kind}.yaml"
            path.write_text(mutated(texts[seed % len(texts)], Random(seed)))
            yield f"{kind}, damaged {seed}", partial(YAML_READERS[kind], path)
            if kind == "scene":
                yield f"scene message, damaged {seed}", partial(parse_scene, path.read_text())
    urdf = share("urdf", "nao_h21_v33.urdf").read_text()
    for seed in range(seeds):
        path = folder / "damaged.urdf"
        path.write_text(mutated(urdf, Random(seed)))
        yield f"URDF, damaged {seed}", partial(load_robot, str(path))
    for storage in ("mcap", "sqlite3"):
        whole = folder / f"whole_{storage}"
        with BagWriter(whole, storage) as writer:
            writer.add_topic("/odom", "nav_msgs/msg/Odometry")
            writer.add_topic("/text", "std_msgs/msg/String")
            for time in range(50):
                writer.write("/text", 10_000_000 * time, b"\0\1\0\0\5\0\0\0walk\0")
        for seed in range(seeds):
            bag = folder / "damaged_bag"
            shutil.rmtree(bag, ignore_errors=True)
            shutil.copytree(whole, bag)
            random = Random(seed)
            for file in random.sample(sorted(bag.iterdir()), random.choice((1, 1, 2))):
                data = bytearray(file.read_bytes())
                for _ in range(random.choice((1, 8, 64))):
                    data[random.randrange(len(data))] = random.randrange(256)
                end = random.choice((len(data), len(data), random.randrange(len(data))))
                file.write_bytes(data[:end])
            yield f"bag {storage}, damaged {seed}", partial(open_bag, bag)


def foreign(folder: Path, every: int) -> Iterator[tuple[str, Callable[[], object]]]:
    """Names and readers of hostile bags; what is in one may be used as far as it goes."""
    for number, (name, path) in enumerate(bags(folder, bomb(9))):
        if number % every == 0:
            yield f"{name}, damaged", partial(open_bag, path)
            yield f"report of {name}, damaged", partial(analyse, path)


def peak() -> int:
    """[bytes] The most that this process has held since the last call."""
    held = re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())
    Path("/proc/self/clear_refs").write_text("5")
    return 1024 * int(held[1]) if held else 0


def read_all(folder: Path, seeds: int, every: int) -> int:
    """Read every hostile file in this process; prints what is wrong, and returns the number."""
    load_robot()
    count, slowest, largest = 0, (0.0, ""), (0, "")
    for name, read in chain(hostile(folder), damaged(folder, seeds), foreign(folder, every)):
        count += 1
        peak()
        before, began = peak(), time.process_time()
        resource.setrlimit(resource.RLIMIT_CPU, (int(began) + 10 * SECONDS, -1))
        try:
            read()
            if name not in HARMLESS and "damaged" not in name:
                print(f"{name}: accepted")
        except NaoGaitError as error:
            text = str(error)
            if len(text) > LONGEST or not text.isprintable():
                print(f"{name}: {text[:500]!r}")
        except BaseException as error:
            print(f"{name}: {type(error).__name__} {error}"[:500])
        used, held = time.process_time() - began, peak() - before
        if used > SECONDS or held > MEMORY:
            print(f"{name}: {used:.1f} s, {held // 2**20} MiB")
        slowest, largest = max(slowest, (used, name)), max(largest, (held, name))
    print(f"at most {slowest[0]:.2f} s ({slowest[1]}), {largest[0] // 2**20} MiB ({largest[1]})")
    return count


@pytest.mark.parametrize(
    ("seeds", "every"), [(10, 9), pytest.param(100, 1, marks=pytest.mark.slow)]
)
def test_hundreds_of_hostile_files_are_each_refused_in_one_short_line(
    tmp_path: Path, seeds: int, every: int
) -> None:
    done = subprocess.run(
        [sys.executable, __file__, str(tmp_path), str(seeds), str(every)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    *wrong, _most, count = done.stdout.splitlines() or ["", "0"]
    assert (wrong, done.stderr, done.returncode) == ([], "", 0)
    assert int(count) > 500 + 10 * seeds


@pytest.mark.parametrize(
    "make", [lambda: ["x"] * 10**6, lambda: {n: n for n in range(10**6)}, lambda: "x" * 10**7],
    ids=["list", "dict", "text"],
)  # fmt: skip
def test_a_huge_value_is_not_shown_whole(make: Callable[[], object]) -> None:
    text = str(NaoGaitError("field", make(), "small values"))
    assert len(text) < 500
    assert text.startswith("field: got ")
    assert "..." in text


def test_values_of_usual_size_are_shown_as_they_are() -> None:
    value = {"a": [1, 2.5, ("x", None)], "b": "text"}
    assert str(NaoGaitError("field", value, "numbers")) == f"field: got {value!r}; allowed: numbers"


if __name__ == "__main__":
    print(read_all(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])))
