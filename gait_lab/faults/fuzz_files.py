"""Fuzzing of the loaders with corrupt files, which must be read or refused with a NaoGaitError."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from hypothesis import strategies as st

from gait_lab.analysis.bag import BagWriter, open_bag
from gait_lab.bench.sweep import load_sweep
from gait_lab.tune.study import load_study
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import load_robot
from sim_bridge.plant import load_plant

BAG = "bag.mcap"
FILES: dict[str, Callable[[Path], Any]] = {
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


@dataclass(frozen=True, slots=True)
class Example:
    """How a file is corrupted.

    Attributes:
        file: One of `FILES`.
        values: Changes of entries of a YAML file as (path of indices, kind, new value).
        bytes: Changes of its bytes as (place as a share of the file, kind, new bytes).
        length: Share of the file that is kept.
    """

    file: str
    values: list[tuple[list[int], str, Any]]
    bytes: list[tuple[float, str, bytes]]
    length: float


EXAMPLES = st.builds(
    Example, st.sampled_from(sorted(FILES)),
    st.lists(st.tuples(
        st.lists(st.integers(0, 63), min_size=1, max_size=5),
        st.sampled_from(("replace", "rename", "remove")), VALUES,
    ), max_size=3),
    st.lists(st.tuples(
        st.floats(0.0, 1.0), st.sampled_from(("replace", "repeat", "remove")),
        st.binary(min_size=1, max_size=40),
    ), max_size=5),
    st.one_of(st.just(1.0), st.floats(0.0, 1.0)),
)  # fmt: skip


def run(example: Example, _: int) -> tuple[int, int]:
    """Load a corrupt file; (1, 0) if it was read, (0, 1) if refused. Raises AssertionError."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"corrupt{Path(example.file).suffix}")
        path.write_bytes(_corrupt(example))
        try:
            FILES[example.file](path)
        except NaoGaitError as error:
            if not (error.field and error.allowed):
                raise AssertionError(f"refusal without field or allowed values: {error}") from error
            return 0, 1
        return 1, 0


def _corrupt(example: Example) -> bytes:
    data = _small_bag() if example.file == BAG else share(*example.file.split("/")).read_bytes()
    if example.values and example.file.endswith(".yaml"):
        document = yaml.safe_load(data)
        for path, kind, value in example.values:
            _change(document, path, kind, value)
        data = yaml.safe_dump(document, allow_unicode=True).encode()
    for where, kind, new in example.bytes:
        begin = round(where * len(data))
        end = min(begin + len(new), len(data))
        middle = {"replace": new, "repeat": 2 * data[begin:end], "remove": b""}[kind]
        data = data[:begin] + middle + data[end:]
    return data[: round(example.length * len(data))]


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
