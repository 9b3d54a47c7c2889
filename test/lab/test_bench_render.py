"""The suite `render` in a small form."""

import json
from pathlib import Path

import pytest

from gait_lab.bench import suite
from robot_core.errors import NaoGaitError


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_an_image_costs_more_than_nothing(engine: str, tmp_path: Path) -> None:
    pytest.importorskip(engine)
    asked = {"engine": engine, "scene": "pitch_small", "images": 1, "width": 64, "height": 48}
    file = tmp_path / "rows.json"
    try:
        suite.run("render", asked, json_file=file, out=lambda _: None)
    except NaoGaitError as error:
        if error.field == "cameras":
            pytest.skip(f"no images here: {error.allowed}")
        raise
    rows = {row["metric"]: row["value"] for row in json.loads(file.read_text())}
    assert 0.0 < rows["render_median"] <= rows["render_worst"]
    assert rows["render_worst_in_ticks"] == pytest.approx(
        rows["render_worst"] / rows["physics_tick"]
    )
