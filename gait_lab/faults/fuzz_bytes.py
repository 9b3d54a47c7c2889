"""Fuzzing by damaged bytes: of files into every loader, of LoLA's messages both ways.

A file must be read or refused with a NaoGaitError. What the bridge sends to the robot must be
within its limits, whatever it gets.
"""

import random
import tempfile
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from hypothesis import strategies as st

from gait_lab.analysis.bag import BagWriter, open_bag
from gait_lab.bench.sweep import load_sweep
from gait_lab.tune.study import load_study
from lola_bridge.codec import (
    COMMAND_BYTES,
    LolaCommand,
    LolaSensors,
    RobotConfig,
    command_stream,
    decode_sensors,
    encode_command,
    encode_sensors,
    read_command,
)
from lola_bridge.joints import JointMap, sitting_pose
from lola_bridge.link import pack_command, unpack_command
from lola_bridge.safety import JointCommand, Safety, SafetySettings
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import load_robot
from sim_bridge.plant import load_plant

Damage = tuple[Sequence[tuple[float, str, bytes]], float]
"""Changes as (place as a share of the bytes, kind, new bytes), and the share that is kept."""
DAMAGE: st.SearchStrategy[Damage] = st.tuples(
    st.lists(st.tuples(
        st.floats(0.0, 1.0), st.sampled_from(("replace", "repeat", "remove")),
        st.binary(min_size=1, max_size=40),
    ), max_size=5),
    st.one_of(st.just(1.0), st.floats(0.0, 1.0)),
)  # fmt: skip


def damaged(data: bytes, damage: Damage) -> bytes:
    """The bytes, of which some are changed, sent twice or left out."""
    changes, kept = damage
    for where, kind, new in changes:
        begin = round(where * len(data))
        end = min(begin + len(new), len(data))
        middle = {"replace": new, "repeat": 2 * data[begin:end], "remove": b""}[kind]
        data = data[:begin] + middle + data[end:]
    return data[: round(kept * len(data))]


# -- files -----------------------------------------------------------------------------------------

BAG = "bag.mcap"
LOADERS: dict[str, Callable[[Path], Any]] = {
    "config/gait/paper.yaml": load_preset,
    "config/plants/reference.yaml": lambda path: load_plant(str(path)),
    "config/plants/worn.yaml": lambda path: load_plant(str(path)),
    "config/robots/nao_h21.yaml": lambda path: load_robot(robot=path),
    "config/studies/speed.yaml": lambda path: load_study(str(path)),
    "config/studies/omni.yaml": lambda path: load_study(str(path)),
    "config/bench/ablation.yaml": load_sweep,
    "urdf/nao_h21_v33.urdf": load_robot,
    BAG: open_bag,
}
VALUES: st.SearchStrategy[Any] = st.one_of(
    st.sampled_from((
        None, True, "", "x", -1, 0, 1e308, float("nan"), float("inf"), [], {}, [1, "a"], {"a": {}},
        "!!python/object/apply:os.system ['true']", 10**400,
    )),
    st.floats(), st.text(max_size=9),
)  # fmt: skip
"""Values that replace a value of a YAML file."""
FILES = st.fixed_dictionaries({
    "file": st.sampled_from(sorted(LOADERS)),
    "values": st.lists(st.tuples(
        st.lists(st.integers(0, 63), min_size=1, max_size=5),
        st.sampled_from(("replace", "rename", "remove")), VALUES,
    ), max_size=3),
    "damage": DAMAGE,
})  # fmt: skip
"""Arguments of `read_file`."""


def read_file(
    _: int, file: str, values: list[tuple[list[int], str, Any]], damage: Damage
) -> tuple[int, int]:
    """Load a corrupt file; (1, 0) if it was read, (0, 1) if refused.

    Args:
        file: One of `LOADERS`.
        values: Changes of entries of a YAML file as (path of indices, kind, new value).
        damage: Changes of its bytes.

    Raises:
        AssertionError: The refusal does not say what is allowed.
    """
    data = _small_bag() if file == BAG else share(*file.split("/")).read_bytes()
    if values and file.endswith(".yaml"):
        document = yaml.safe_load(data)
        for entry, kind, value in values:
            _change(document, entry, kind, value)
        data = yaml.safe_dump(document, allow_unicode=True).encode()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"corrupt{Path(file).suffix}")
        path.write_bytes(damaged(data, damage))
        try:
            LOADERS[file](path)
        except NaoGaitError as error:
            if not (error.field and error.allowed):
                raise AssertionError(f"refusal without field or allowed values: {error}") from error
            return 0, 1
        return 1, 0


def _change(node: Any, path: list[int], kind: str, value: Any) -> None:
    """Replace, rename or remove the entry at the end of a path."""
    for depth, index in enumerate(path):
        if not isinstance(node, dict | list) or not node:
            return
        keys: list[Any] = list(node) if isinstance(node, dict) else list(range(len(node)))
        key = keys[index % len(keys)]
        if depth < len(path) - 1 and isinstance(node[key], dict | list) and node[key]:
            node = node[key]
            continue
        if kind == "remove":
            del node[key]
        elif kind == "rename" and isinstance(node, dict):
            node[f"{key}_"] = node.pop(key)
        else:
            node[key] = value
        return


@lru_cache(1)
def _small_bag() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        writer = BagWriter(Path(folder, "bag"))
        writer.add_topic("/gait/support", "std_msgs/msg/String")
        for index in range(50):
            # A string in CDR: header, length including the final zero, text.
            writer.write("/gait/support", index * 10_000_000, b"\0\1\0\0\6\0\0\0stand\0")
        writer.close()
        (path,) = Path(folder, "bag").glob("*.mcap")
        return path.read_bytes()


# -- LoLA ------------------------------------------------------------------------------------------

PERIOD = 0.012
DAMAGED_SHARE = 0.3
"""Share of the messages with changed bytes."""
ROUNDING = 1e-6
"""[rad] of a float32."""
LIMP = 0.06
"""Stiffness up to which a joint may move at any speed."""
ROBOT = load_robot("nao_v6")
JOINTS = JointMap(ROBOT)
LOWER, UPPER, SPEED = map(np.array, JOINTS.limits())
CONFIG = RobotConfig("P0000000S00S00S00000", "6.0.0", "P0000000S00S00S00000", "6.0.0")
LOLA = st.fixed_dictionaries({
    "seed": st.integers(0, 2**32),
    "numbers": st.lists(st.floats(width=32)),
    "damage": st.lists(DAMAGE),
})  # fmt: skip
"""Arguments of `exchange`: each number and each damage comes many times."""


def exchange(
    frames: int, seed: int, numbers: list[float], damage: list[Damage]
) -> tuple[int, int]:
    """Send frames and commands; the numbers of commands sent and of refusals.

    Raises:
        AssertionError: A command is not what the robot may get.
    """
    rig = LolaRig(seed, numbers, damage)
    for _ in range(frames):
        rig.to_bridge()
        rig.to_robot()
    return frames, rig.refused


class LolaRig:
    """A robot that sends good and damaged frames, and a gait that sends absurd commands."""

    def __init__(self, seed: int, numbers: list[float], damage: list[Damage]) -> None:
        self._random, self._numbers, self._damage = random.Random(seed), numbers, damage
        sit = JOINTS.from_gait(sitting_pose(ROBOT))
        self._safety = Safety(SafetySettings(
            PERIOD, 0.12, 0.06, 0.12, *JOINTS.limits(), JOINTS.driven, sit
        ))  # fmt: skip
        self._stand = LolaCommand(JOINTS.from_gait(ROBOT.stand_pose), [1.0] * 25, (0.0, 1.0, 0.0))
        self._position, self._stiffness = np.zeros(25), np.zeros(25)
        self.refused = 0

    def to_bridge(self) -> None:
        """A frame and a command, and what the bridge answers to the robot."""
        sensors: LolaSensors | None = None
        command: JointCommand | None = None
        try:
            sensors = decode_sensors(self._damaged(encode_sensors(self._frame())))
        except NaoGaitError:
            self.refused += 1
        if self._random.random() < 0.8:
            position, stiffness = ([self._number(s) for _ in range(25)] for s in (2.0, 1.5))
            try:
                packet = self._damaged(pack_command(0, position, stiffness))
                command = unpack_command(packet)[1]
            except NaoGaitError:
                self.refused += 1
        sent = self._safety.step(sensors, command)
        self._check(encode_command(LolaCommand(sent.position, sent.stiffness, (0.0,) * 3)))

    def to_robot(self) -> None:
        """A command as it comes out of a damaged stream."""
        parser = command_stream()
        try:
            parser.feed(self._damaged(encode_command(self._stand)))
            for found in parser:
                read_command(found)
        except ValueError:  # of MessagePack, or a NaoGaitError
            self.refused += 1

    def _check(self, message: bytes) -> None:
        """The size, the limits of angles and stiffness, and the speed of stiff joints."""
        if len(message) > COMMAND_BYTES:
            raise AssertionError(f"{len(message)} bytes")
        parser = command_stream()
        parser.feed(message)
        (found,) = map(read_command, parser)
        position, stiffness = np.array(found.position), np.array(found.stiffness)
        inside = (position >= LOWER - ROUNDING) & (position <= UPPER + ROUNDING)
        if not inside.all():
            raise AssertionError(f"position {position.tolist()}")
        if not ((stiffness >= 0.0) & (stiffness <= 1.0)).all():
            raise AssertionError(f"stiffness {stiffness.tolist()}")
        held = (stiffness > LIMP) & (self._stiffness > LIMP)
        quick = np.abs(position - self._position) > SPEED * PERIOD + ROUNDING
        if (held & quick).any():
            raise AssertionError(f"from {self._position.tolist()} to {position.tolist()}")
        self._position, self._stiffness = position, stiffness

    def _damaged(self, message: bytes) -> bytes:
        if not self._damage or self._random.random() > DAMAGED_SHARE:
            return message
        return damaged(message, self._random.choice(self._damage))

    def _number(self, size: float) -> float:
        if self._numbers and self._random.random() < 0.2:
            return self._random.choice(self._numbers)
        return self._random.uniform(-size, size)

    def _frame(self) -> LolaSensors:
        number = self._number
        return LolaSensors(
            stiffness=[number(1.0)] * 25, position=[number(2.0) for _ in range(25)],
            temperature=[number(60.0)] * 25, battery=[abs(number(1.0)), number(3.0), 0.0, 30.0],
            current=[number(1.0)] * 25, status=[self._random.randrange(4)] * 25,
            accelerometer=[number(10.0)] * 3, gyroscope=[number(2.0)] * 3,
            angles=[number(0.5)] * 2, sonar=[number(2.0)] * 2, fsr=[number(3.0)] * 8,
            touch=[float(self._random.random() < 0.02) for _ in range(14)], robot_config=CONFIG,
        )  # fmt: skip
