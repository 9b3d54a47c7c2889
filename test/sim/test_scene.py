"""Scenes: the shipped files, and what is refused in a file."""

from pathlib import Path

import pytest
import yaml

from robot_core.errors import NaoGaitError
from robot_core.resources import names, share
from sim_bridge.plant import Plant, with_options
from sim_bridge.scene import load_scene, parse_scene
from sim_bridge.world import World


def scene_file(folder: Path, **changes: object) -> Path:
    """A scene with two robots, with some keys replaced."""
    values: dict[str, object] = {
        "field": {},
        "goals": {},
        "ball": {},
        "robots": [
            {"name": "a", "team": "red", "number": 1, "urdf": "nao_h21_v33", "pose": [-1, 0, 0]},
            {"name": "b", "team": "red", "number": 2, "urdf": "bruno", "pose": [1, 0, 3.1]},
        ],
    }
    path = folder / "scene.yaml"
    path.write_text(yaml.safe_dump({**values, **changes}))
    return path


def two(**changes: object) -> list[dict[str, object]]:
    """Two robots, the second one with some keys replaced; a key that is None is left out."""
    first = {"name": "a", "team": "red", "number": 1, "urdf": "nao_h21_v33", "pose": [-1, 0, 0]}
    second = {**first, "name": "b", "number": 2, "pose": [1, 0, 0], **changes}
    return [first, {key: value for key, value in second.items() if value is not None}]


def test_shipped_scenes_can_be_read_and_their_robots_fit() -> None:
    assert {"pitch", "pitch_small"} <= set(names("scenes"))
    for name in names("scenes"):
        scene = load_scene(name)
        assert scene.name == name
        assert len(scene.robot_specs()) == len(scene.robots)
        assert scene.surroundings().markings


def test_a_scene_is_the_same_after_it_was_written(tmp_path: Path) -> None:
    scene = load_scene(scene_file(tmp_path, poles=[{"x": 0.0, "y": 3.5}]))
    assert parse_scene(scene.to_yaml()) == scene
    with pytest.raises(NaoGaitError, match=r"scene: robots\[1\].urdf: got 'nothing'"):
        parse_scene(scene.to_yaml().replace("urdf:", "# urdf:"))


def test_each_robot_has_noise_of_its_own() -> None:
    specs = load_scene("pitch").robot_specs(noise_seed=7)
    assert [spec.noise_seed for spec in specs] == [7, 8, 9, 10]


@pytest.mark.parametrize(
    ("changes", "refusal"),
    [
        ({"robots": []}, "robots: got .*a list of 1 to 22 items"),
        ({"robots": two(name="a")}, "robots: got 'a twice'; allowed: each name once"),
        ({"robots": two(number=1)}, "robots: got 'red 1 twice'"),
        ({"robots": two(name="ground_truth")}, "robots: got 'ground_truth'; allowed: a name other"),
        ({"robots": two(name="Red 1")}, r"robots\[2\].name: got 'Red 1'"),
        ({"robots": two(urdf=None)}, r"robots\[2\].urdf: got 'nothing'; allowed: a text .required"),
        ({"robots": two(team="green")}, r"robots\[2\].team: got 'green'; allowed: one of"),
        ({"robots": two(pose=[0, 0])}, r"robots\[2\].pose: got .*\[x, y, heading\]"),
        ({"robots": two(pose=[0, 0, "left"])}, r"robots\[2\].pose: got .*\[x, y, heading\]"),
        ({"field": None}, "goals: got 'goals without a field'"),
        ({"field": {"penalty_mark": 4.5}}, "field.penalty_mark: got 4.5"),
        ({"goals": {"width": 6.0}}, "goals.width: got 6.0"),
        ({"trees": 3}, "trees: got 3; allowed: one of the keys name, robots, field"),
    ],
)
def test_a_scene_that_cannot_be_is_refused_in_one_line(
    tmp_path: Path, changes: dict[str, object], refusal: str
) -> None:
    path = scene_file(tmp_path, **changes)
    with pytest.raises(NaoGaitError, match=refusal) as error:
        load_scene(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_an_unknown_urdf_names_the_robot(tmp_path: Path) -> None:
    scene = load_scene(scene_file(tmp_path, robots=two(urdf="asimo")))
    with pytest.raises(NaoGaitError, match="scene scene: b: urdf: got 'asimo'; allowed: a shipped"):
        scene.robot_specs()


def test_a_urdf_beside_the_scene_is_found(tmp_path: Path) -> None:
    (tmp_path / "mine.urdf").write_text(share("urdf", "nao_h21_v33.urdf").read_text())
    scene = load_scene(scene_file(tmp_path, robots=two(urdf="mine.urdf")))
    assert scene.robot_specs()[1].robot.urdf_path == tmp_path / "mine.urdf"


@pytest.mark.parametrize(
    ("changes", "things"),
    [
        ({"robots": two(pose=[-0.95, 0.05, 1.0])}, "b at .* overlaps a"),
        ({"robots": two(pose=[4.5, 0.8, 0.0])}, "b at .* overlaps goal_1_post_1"),
        ({"robots": two(pose=[0.0, 0.0, 0.0])}, "b at .* overlaps the ball"),
        ({"poles": [{"x": 1.0, "y": 0.1}]}, "b at .* overlaps pole_0_0"),
    ],
)
@pytest.mark.usefixtures("mujoco_only")
def test_what_overlaps_is_named(
    tmp_path: Path, reference: Plant, changes: dict[str, object], things: str
) -> None:
    scene = load_scene(scene_file(tmp_path, **changes))
    with pytest.raises(NaoGaitError, match=f"robots: got '{things}'"):
        World.of_scene(scene, reference, engine="mujoco")


@pytest.mark.usefixtures("mujoco_only")
def test_uneven_ground_has_no_field(reference: Plant) -> None:
    uneven = with_options(reference, [("terrain.kind", "hexagons")])
    with pytest.raises(NaoGaitError, match="flat or carpet in scene pitch"):
        World.of_scene(load_scene("pitch"), uneven, engine="mujoco")
