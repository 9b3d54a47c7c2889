"""Uneven ground and soles: the geometry's laws, and a robot that stands on it in both engines."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot
from sim_bridge.engines.registry import installed
from sim_bridge.individual import draw_individual
from sim_bridge.plant import Plant, PlantOption, Terrain, load_plant, parse_options, with_options
from sim_bridge.soles import contact_of, sole_points
from sim_bridge.terrain import Prism, ground_height, hexagons, prisms
from sim_bridge.world import World

ENGINES = [
    pytest.param(name, marks=pytest.mark.skipif(not installed(name), reason=f"no {name}"))
    for name in ("pybullet", "mujoco")
]
PLATE = (("terrain.kind", "hexagons"), ("terrain.plate", 1.0), ("terrain.start", 0.0))
"""One hexagon that is larger than a robot, right under it."""


@pytest.fixture(scope="module")
def bruno() -> RobotDescription:
    return load_robot("bruno")


def plant_with(*options: PlantOption, name: str = "reference") -> Plant:
    return with_options(load_plant(name), options)


# -- geometry


@settings(max_examples=40)
@given(
    seed=st.integers(-1, 500),
    height=st.floats(0.0, 0.1),
    plate=st.floats(0.05, 0.5),
    length=st.floats(0.3, 2.0),
    width=st.floats(0.3, 2.0),
    at=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
)
def test_hexagons_cover_their_field_and_keep_their_heights(
    seed: int, height: float, plate: float, length: float, width: float, at: tuple[float, float]
) -> None:
    terrain = Terrain("hexagons", 0.25, length, width, height, plate)
    plates = hexagons(terrain, seed)
    x, y = 0.25 + at[0] * length, (at[1] - 0.5) * width
    tops = [top for prism in plates if (top := prism.height_at(x, y)) is not None]
    assert tops
    assert all(-1e-9 <= top <= height + 1e-9 for top in tops)
    area = sum(_area(prism) for prism in plates)
    # Flats of `plate`, no plate over another: all lie in the field with its rim.
    rim = 2.0 * plate
    assert area <= (length + rim) * (width + rim)
    assert _area(plates[0]) == pytest.approx(math.sqrt(3.0) / 2.0 * plate**2)


def test_plates_do_not_overlap() -> None:
    plates = hexagons(Terrain("hexagons"), 3)
    rng = np.random.default_rng(0)
    for x, y in rng.uniform((0.26, -0.74), (1.24, 0.74), (300, 2)):
        assert sum(prism.height_at(x, y) is not None for prism in plates) == 1


def test_a_field_belongs_to_its_seed() -> None:
    heights = [
        [prism.top[0] for prism in hexagons(Terrain("hexagons"), seed)] for seed in (4, 4, 5, -1)
    ]
    assert heights[0] == heights[1] != heights[2]
    assert heights[3] != heights[0]
    assert {round(1000.0 * height) for height in heights[0]} == {0, 5, 10, 15}


def test_a_ramp_goes_up_and_down_and_steps_are_equally_high() -> None:
    ramp = prisms(Terrain("ramp", height=0.03), 0)
    xs = (0.2, 0.25 + 1.0 / 6.0, 0.75, 1.25 - 1.0 / 6.0, 1.3)
    assert [ground_height(ramp, x, 0.3) for x in xs] == pytest.approx([0, 0.015, 0.03, 0.015, 0])
    steps = prisms(Terrain("steps", height=0.01), 0)
    heights = [ground_height(steps, x, 0.0) for x in (0.1, 0.4, 0.75, 1.1, 1.4)]
    assert heights == pytest.approx([0.0, 0.01, 0.02, 0.01, 0.0])


def test_level_ground_has_nothing_on_it() -> None:
    assert prisms(Terrain(), 0) == prisms(Terrain("carpet"), 0) == ()
    assert prisms(Terrain("ramp", height=0.0), 0) == ()


@pytest.mark.parametrize("kind", ["hexagons", "ramp", "steps"])
def test_the_surface_of_a_prism_is_closed_and_faces_outwards(kind: str) -> None:
    for prism in prisms(Terrain(kind), 1):
        corners = prism.vertices[list(map(list, prism.triangles))]
        edges = [pair for a, b, c in prism.triangles for pair in ((a, b), (b, c), (c, a))]
        assert len(set(edges)) == len(edges)
        assert {(b, a) for a, b in edges} == set(edges)
        # The divergence theorem: the volume is positive where all triangles face outwards.
        volume = np.linalg.det(corners).sum() / 6.0
        expected = _area(prism) * (np.mean(prism.top) + 0.05)
        assert volume == pytest.approx(expected)


def _area(prism: Prism) -> float:
    x, y = prism.outline.T
    return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


# -- the plant


def test_shipped_plants_are_level_and_options_are_checked() -> None:
    for name in ("reference", "ideal", "worn"):
        plant = load_plant(name)
        assert plant.terrain.kind == "flat"
        assert plant.sole.kind == "own"
    options = parse_options(("terrain.kind=hexagons", "terrain.height=0.01", "sole.kind=sponge"))
    plant = plant_with(*options)
    assert plant.terrain.kind == "hexagons"
    assert plant.terrain.height == 0.01
    with pytest.raises(NaoGaitError, match="flat, hexagons, ramp, steps, carpet"):
        parse_options(("terrain.kind=sand",))


# -- soles


def test_the_sponge_has_the_published_size(bruno: RobotDescription) -> None:
    corners = np.array(sole_points(plant_with(("sole.kind", "sponge")), bruno).corners)
    assert np.ptp(corners, axis=0) == pytest.approx((0.206, 0.05))
    own = np.array(bruno.sole_corners)
    assert corners[:, 0].min() == own[:, 0].min()
    assert corners[:, 1].mean() == pytest.approx(own[:, 1].mean())


def test_points_between_the_corners_share_their_stiffness(bruno: RobotDescription) -> None:
    level, rough = plant_with(), plant_with(("terrain.kind", "hexagons"))
    robot = draw_individual(level, bruno, 2)
    assert sole_points(level, bruno).points == bruno.sole_corners
    points = sole_points(rough, bruno).points
    assert set(bruno.sole_corners) < set(points)
    whole = [4.0 * value for value in contact_of(level, robot, 4, 3.3)]
    shared = [len(points) * value for value in contact_of(rough, robot, len(points), 3.3)]
    assert shared == pytest.approx(whole)


def test_soft_layers_are_springs_in_series(bruno: RobotDescription) -> None:
    options = (("sole.kind", "spring"), ("sole.stiffness", 2500.0))
    carpet = (("terrain.kind", "carpet"), ("terrain.carpet_stiffness", 2000.0))
    nominal = draw_individual(plant_with(), bruno, -1)
    stiffness, _ = contact_of(plant_with(*options, *carpet), nominal, 4, 3.3)
    assert 1.0 / stiffness == pytest.approx(1.0 / 1e4 + 1.0 / 2500.0 + 1.0 / 2000.0)
    with pytest.raises(NaoGaitError, match="rigid"):
        sole_points(plant_with(("sole.kind", "spring"), name="ideal"), bruno)


def test_a_heavy_robot_sinks_no_further_than_the_one_for_which_the_floor_is(
    bruno: RobotDescription
) -> None:
    plant = plant_with()
    nominal = draw_individual(plant, bruno, -1)
    limit = plant.contact.mass
    light, at_limit, heavy = (contact_of(plant, nominal, 4, m) for m in (3.3, limit, 5.0 * limit))
    assert light == at_limit == (plant.contact.stiffness, plant.contact.damping)
    assert heavy == pytest.approx([5.0 * value for value in at_limit])


# -- both engines


def stand(robot: RobotDescription, engine: str, *options: PlantOption) -> tuple[float, float]:
    """Height [m] of the middle of the lower sole, and the load [N], after half a second."""
    with World.single(robot, plant_with(*options), robot_seed=-1, engine=engine) as world:
        for _ in range(50):
            world.step()
        truth = world.robot.truth()
    return float(min(sole.position[2] for sole in truth.soles)), float(truth.sole_force.sum())


@pytest.mark.parametrize("engine", ENGINES)
def test_a_robot_stands_on_a_plate_as_high_as_it_is(engine: str, bruno: RobotDescription) -> None:
    level, weight = stand(bruno, engine)
    plate = ground_height(prisms(plant_with(*PLATE).terrain, -1), 0.0, 0.0)
    assert plate > 0.004
    height, load = stand(bruno, engine, *PLATE)
    assert height - level == pytest.approx(plate, abs=3e-4)
    assert load == pytest.approx(weight, rel=0.02)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_robot_sinks_into_what_is_soft(engine: str, bruno: RobotDescription) -> None:
    level, weight = stand(bruno, engine)
    soft, load = stand(bruno, engine, ("terrain.kind", "carpet"), ("sole.kind", "sponge"))
    expected = weight / 8.0 * (1.0 / 2000.0 + 1.0 / 3000.0)
    assert level - soft == pytest.approx(expected, rel=0.35)
    assert load == pytest.approx(weight, rel=0.02)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_field_ahead_changes_nothing_before_it_is_reached(
    engine: str, bruno: RobotDescription
) -> None:
    """With spring soles, which keep their four points."""
    sole: tuple[PlantOption, ...] = (("sole.kind", "spring"),)
    ahead = (("terrain.kind", "steps"), ("terrain.start", 2.0))
    assert stand(bruno, engine, *sole) == stand(bruno, engine, *sole, *ahead)
