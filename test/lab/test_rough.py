"""The suite `rough` and the crossings behind it."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from scores import options

from gait_lab.bench import registry
from gait_lab.bench.suites.rough import GIVEN, WALKERS, parameters_of, walkers_of
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from sim_bridge.plant import PlantOption
from sim_bridge.trials.crossing import STEERING_MAX, CrossingRobot, CrossingSpec, cross, plant_of
from sim_bridge.trials.tasks import STAND_TIME

LEVEL: tuple[PlantOption, ...] = (
    ("terrain.kind", "flat"), ("terrain.start", 0.1), ("terrain.length", 0.3),
)  # fmt: skip
"""A short and level field."""
BRUNO = CrossingRobot("bruno", "bruno", "bruno", "own", 0.24)


def spec_of(walker: CrossingRobot, *options: PlantOption) -> CrossingSpec:
    return CrossingSpec(
        walker, parameters=load_preset("bruno"), robot_seed=1, plant_options=(*LEVEL, *options),
        engine="mujoco",
    )  # fmt: skip


def test_a_command_has_pauses_and_steers() -> None:
    walker = CrossingRobot("w", "bruno", "bruno", "own", 0.1, steps=4.0, pause=1.0)
    times = (-0.5, 0.5, 2.0, 4.5, 5.5, 9.5, 10.5)
    speeds = [walker.command_at(STAND_TIME + time, 0.0).x for time in times]
    assert speeds == pytest.approx([0.0, 0.05, 0.1, 0.0, 0.1, 0.0, 0.1])
    later = STAND_TIME + 2.0
    assert walker.command_at(later, 0.2).yaw < 0.0 < walker.command_at(later, -0.2).yaw
    assert walker.command_at(later, 0.0, 0.2).yaw < 0.0 < walker.command_at(later, 0.0, -0.2).yaw
    assert abs(walker.command_at(later, 3.0).yaw) == pytest.approx(STEERING_MAX)


def test_the_time_of_a_crossing_fits_the_speed() -> None:
    pytest.importorskip("mujoco")
    result = cross(spec_of(BRUNO))
    assert result.end == "crossed"
    assert result.seconds is not None
    # At most the commanded 24 cm/s, and at least half of it.
    assert 0.3 / 0.26 < result.seconds < 0.3 / 0.12
    assert result.way == pytest.approx(0.3)
    assert cross(spec_of(BRUNO)) == result


def test_a_fall_or_leaving_the_field_is_not_a_crossing(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    fell = cross(spec_of(BRUNO, ("terrain.kind", "hexagons"), ("terrain.height", 0.1)))
    assert fell.end == "fell"
    assert fell.seconds is None
    assert fell.way < 0.3
    monkeypatch.setattr("sim_bridge.trials.crossing.INWARDS", -5.0)  # steered over the edge
    left = cross(spec_of(BRUNO, ("terrain.width", 0.2), ("terrain.length", 10.0)))
    assert left.end == "left"
    assert left.seconds is None


def test_options_replace_the_field_and_the_soles() -> None:
    sponge = CrossingRobot("w", "bruno", "bruno", "sponge", 0.1)
    plant = plant_of(CrossingSpec(sponge))
    assert (plant.terrain.kind, plant.sole.kind) == ("hexagons", "sponge")
    plant = plant_of(spec_of(sponge, ("sole.kind", "own")))
    assert (plant.terrain.kind, plant.sole.kind) == ("flat", "own")


def test_open_loop_and_given_walks() -> None:
    asked = options("rough", tasks=("forward=15",)).but(parameters=load_preset("zmp"))
    assert walkers_of(asked) == WALKERS
    assert not parameters_of(WALKERS[0], asked, closed=False).feedback
    assert parameters_of(WALKERS[0], asked, closed=True) == load_preset("rough_slow")
    given = asked.but(experiments=(GIVEN,))
    (walker,) = walkers_of(given)
    assert walker.speed == pytest.approx(0.15)
    assert walker.urdf == given.urdf
    assert parameters_of(walker, given, closed=True) == load_preset("zmp")
    with pytest.raises(NaoGaitError, match="bruno_slow"):
        options("rough", experiments=("sand",))


def test_the_suite_writes_its_rows(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    file, said = tmp_path / "rows.json", list[str]()
    asked: dict[str, Any] = {
        "robots": 2, "seed": 1, "engine": "mujoco", "jobs": 1, "show": False,
        "experiments": ("bruno_fast",), "open_loop": "off", "plant_options": LEVEL,
    }  # fmt: skip
    registry.run("rough", asked, json_file=file, out=said.append)
    rows = {row["metric"]: row for row in json.loads(file.read_text())}
    ends = [rows[f"bruno_fast_{end}"]["value"] for end in ("crossed", "fell", "left", "late")]
    assert sum(ends) == rows["bruno_fast_runs"]["value"] == 2
    assert rows["bruno_fast_crossed_share"]["value"] == 50.0 * ends[0]
    assert rows["bruno_fast_time_median"]["paper"] == 7.5
    assert math.isfinite(rows["bruno_fast_way_mean"]["value"])
    assert "bruno fast" in said[0]
    assert "7.5" in said[0]
