"""The file of measured errors of percepts."""

from pathlib import Path

import pytest
import yaml

from gait_lab.vision.percept_errors import load_percept_errors
from robot_core.errors import NaoGaitError
from robot_core.resources import find

FILE = find("vision", "percept_errors")


def test_recall_is_interpolated_between_distances_and_ends_with_them():
    errors = load_percept_errors()
    low, high = errors.distances[-2:]
    for name, kind in errors.kinds.items():
        assert errors.recall(name, low) == kind.recall[-2]
        middle = 0.5 * (kind.recall[-2] + kind.recall[-1])
        assert errors.recall(name, 0.5 * (low + high)) == pytest.approx(middle)
        assert errors.recall(name, high + 0.01) == 0.0


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"distances": [0.5, 0.25]}, "distances"),
        ({"distances": [0.25, 0.5]}, "recall"),
        ({"delay": None}, "delay"),
        ({"tilt": {"robot": -0.1, "image": 0.0}}, "tilt.robot"),
    ],
)
def test_bad_file_is_refused_in_one_line(tmp_path: Path, change: dict, field: str):
    values = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    path = tmp_path / "errors.yaml"
    path.write_text(yaml.safe_dump({**values, **change}), encoding="utf-8")
    with pytest.raises(NaoGaitError, match=field) as refusal:
        load_percept_errors(path)
    assert "\n" not in str(refusal.value)
