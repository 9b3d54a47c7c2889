"""Broken files into every loader: each one reads them, or refuses them with a NaoGaitError."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from gait_lab.analysis.bag import BagWriter
from gait_lab.analysis.bag_reading import open_bag
from gait_lab.bench.changes import load_changes
from gait_lab.tune.study import load_study
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.resources import share
from nao_lipm_gait.robot import load_robot
from sim_bridge.plant import load_plant

Load = Callable[[Path], Any]
VALUES: tuple[Any, ...] = (
    None, True, "", "x", -1, 0, 1e308, float("nan"), float("inf"), [], {}, [1, "a"], {"a": {}},
    "!!python/object/apply:os.system ['true']", 10**400,
)  # fmt: skip
"""Put where something else was."""


def _load_robot(path: Path) -> Any:
    return load_robot(robot=path)


def _load_study(path: Path) -> Any:
    return load_study(str(path))


def _load_plant(path: Path) -> Any:
    return load_plant(str(path))


YAML_FILES: tuple[tuple[str, str, Load], ...] = (
    ("preset", "config/gait/default.yaml", load_preset),
    ("plant", "config/plants/reference.yaml", _load_plant),
    ("plant", "config/plants/worn.yaml", _load_plant),
    ("robot", "config/robots/nao_h21.yaml", _load_robot),
    ("study", "config/studies/speed.yaml", _load_study),
    ("study", "config/studies/omni.yaml", _load_study),
    ("ablation", "config/bench/ablation.yaml", load_changes),
)


@dataclass(frozen=True, slots=True)
class FilesFound:
    """What broken files did."""

    read: int
    refused: int
    violations: tuple[str, ...]


def fuzz_files(seed: int, count: int) -> FilesFound:
    """Break and read so many files, all kinds in turn."""
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
                path = Path(folder, "broken.yaml")
                path.write_bytes(_broken_yaml(random, share(*source.split("/"))))
            elif kind == len(YAML_FILES):
                name, load = "urdf", load_robot
                path = Path(folder, "broken.urdf")
                path.write_bytes(_broken_bytes(random, share("urdf", "nao_h21_v33.urdf")))
            else:
                name, load = "bag", open_bag
                path = Path(folder, "broken.mcap")
                path.write_bytes(_broken_bytes(random, bag))
            try:
                load(path)
                read += 1
            except NaoGaitError as error:
                refused += 1
                if not (error.field and error.allowed):
                    violations.append(f"{name} {index}: refused without a reason: {error}")
            except Exception as error:
                violations.append(f"{name} {index}: {type(error).__name__}: {error}"[:300])
    return FilesFound(read, refused, tuple(violations))


def _small_bag(folder: Path) -> Path:
    writer = BagWriter(folder)
    writer.add_topic("/gait/support", "std_msgs/msg/String")
    for index in range(50):
        # A CDR string: header, length with the final zero, text.
        writer.write("/gait/support", index * 10_000_000, b"\0\1\0\0\6\0\0\0stand\0")
    writer.close()
    (path,) = folder.glob("*.mcap")
    return path


def _broken_bytes(random: np.random.Generator, path: Path) -> bytes:
    """Bytes changed, cut out, doubled or cut off."""
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


def _broken_yaml(random: np.random.Generator, path: Path) -> bytes:
    """Broken as text, or well-formed with something else in some places."""
    if random.uniform() < 0.4:
        return _broken_bytes(random, path)
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    for _ in range(int(random.integers(1, 4))):
        _change(random, document)
    return yaml.safe_dump(document, allow_unicode=True).encode()


def _change(random: np.random.Generator, node: Any) -> None:
    """Walk down at random and put, take away or rename something there."""
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
