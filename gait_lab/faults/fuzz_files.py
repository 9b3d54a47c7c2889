"""Corrupt files for every loader, which must read them or raise NaoGaitError."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from gait_lab.analysis.bag import BagWriter, open_bag
from gait_lab.bench.changes import load_changes
from gait_lab.tune.study import load_study
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import load_robot
from sim_bridge.plant import load_plant

Load = Callable[[Path], Any]
VALUES: tuple[Any, ...] = (
    None, True, "", "x", -1, 0, 1e308, float("nan"), float("inf"), [], {}, [1, "a"], {"a": {}},
    "!!python/object/apply:os.system ['true']", 10**400,
)  # fmt: skip
"""Values that replace a value of the file."""


def _load_robot(path: Path) -> Any:
    return load_robot(robot=path)


def _load_study(path: Path) -> Any:
    return load_study(str(path))


def _load_plant(path: Path) -> Any:
    return load_plant(str(path))


YAML_FILES: tuple[tuple[str, str, Load], ...] = (
    ("preset", "config/gait/paper.yaml", load_preset),
    ("plant", "config/plants/reference.yaml", _load_plant),
    ("plant", "config/plants/worn.yaml", _load_plant),
    ("robot", "config/robots/nao_h21.yaml", _load_robot),
    ("study", "config/studies/speed.yaml", _load_study),
    ("study", "config/studies/omni.yaml", _load_study),
    ("ablation", "config/bench/ablation.yaml", load_changes),
)


@dataclass(frozen=True, slots=True)
class FileFuzzResult:
    """Result of loading corrupt files.

    Attributes:
        read: Files that were still valid.
        refused: Files that were refused with a NaoGaitError.
        violations: Any other exception, and refusals without field or allowed values.
    """

    read: int
    refused: int
    violations: tuple[str, ...]


def fuzz_files(seed: int, count: int) -> FileFuzzResult:
    """Corrupt and load `count` files, all kinds in turn."""
    random = np.random.default_rng(seed)
    read = refused = 0
    violations: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        bag = _small_bag(Path(folder, "bag"))
        kinds = len(YAML_FILES) + 2
        for index in range(count):
            kind = index % kinds
            if kind < len(YAML_FILES):
                name, source, load = YAML_FILES[kind]
                path = Path(folder, "corrupt.yaml")
                path.write_bytes(_corrupt_yaml(random, share(*source.split("/"))))
            elif kind == len(YAML_FILES):
                name, load = "urdf", load_robot
                path = Path(folder, "corrupt.urdf")
                path.write_bytes(_corrupt_bytes(random, share("urdf", "nao_h21_v33.urdf")))
            else:
                name, load = "bag", open_bag
                path = Path(folder, "corrupt.mcap")
                path.write_bytes(_corrupt_bytes(random, bag))
            try:
                load(path)
                read += 1
            except NaoGaitError as error:
                refused += 1
                if not (error.field and error.allowed):
                    violations.append(f"{name} {index}: refusal without allowed values: {error}")
            except Exception as error:
                violations.append(f"{name} {index}: {type(error).__name__}: {error}"[:300])
    return FileFuzzResult(read, refused, tuple(violations))


def _small_bag(folder: Path) -> Path:
    writer = BagWriter(folder)
    writer.add_topic("/gait/support", "std_msgs/msg/String")
    for index in range(50):
        # A string in CDR: header, length including the final zero, text.
        writer.write("/gait/support", index * 10_000_000, b"\0\1\0\0\6\0\0\0stand\0")
    writer.close()
    (path,) = folder.glob("*.mcap")
    return path


def _corrupt_bytes(random: np.random.Generator, path: Path) -> bytes:
    """Change, remove, repeat or truncate bytes of a file."""
    data = bytearray(path.read_bytes())
    for _ in range(int(random.integers(1, 6))):
        begin = int(random.integers(len(data)))
        end = min(len(data), begin + int(random.integers(1, 40)))
        kind = int(random.integers(4))
        if kind == 0:
            data[begin] = int(random.integers(256))
        elif kind == 1:
            del data[begin:end]
        elif kind == 2:
            data[begin:begin] = data[begin:end]
        else:
            data[begin:end] = random.bytes(end - begin)
        if not data:
            return b""
    return bytes(data[: int(random.integers(len(data)))] if random.uniform() < 0.2 else data)


def _corrupt_yaml(random: np.random.Generator, path: Path) -> bytes:
    """Corrupt the bytes of a YAML file, or replace some of its values."""
    if random.uniform() < 0.4:
        return _corrupt_bytes(random, path)
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    for _ in range(int(random.integers(1, 4))):
        _change(random, document)
    return yaml.safe_dump(document, allow_unicode=True).encode()


def _change(random: np.random.Generator, node: Any) -> None:
    """Replace, remove or rename a random entry of a nested document."""
    while isinstance(node, dict | list) and node:
        keys: list[Any] = list(node) if isinstance(node, dict) else list(range(len(node)))
        key = keys[int(random.integers(len(keys)))]
        deeper = isinstance(node[key], dict | list) and node[key] and random.uniform() < 0.8
        if deeper:
            node = node[key]
            continue
        kind = int(random.integers(4))
        if kind == 0:
            del node[key]
        elif kind == 1 and isinstance(node, dict):
            node[f"{key}_"] = node.pop(key)
        else:
            node[key] = VALUES[int(random.integers(len(VALUES)))]
        return
