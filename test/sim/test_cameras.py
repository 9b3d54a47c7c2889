"""Images of the simulated robots: where things are in them, when they come, what spoils them."""

import ctypes.util
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.robot.camera import CameraView, Intrinsics, RgbImage
from robot_core.types import FloatArray
from sim_bridge.ball import Ball
from sim_bridge.cameras.camera import CameraImage, CameraSettings, make_cameras
from sim_bridge.cameras.effects import ImageEffects, blurred
from sim_bridge.plant import CameraPlant, load_plant, with_options
from sim_bridge.robot import RobotSpec
from sim_bridge.scene import load_scene
from sim_bridge.world import World

ENGINES = ("pybullet", "mujoco")
BALL = Ball()
SETTINGS = CameraSettings(width=160, height=120, delay=0.0)
PINHOLE = Intrinsics.from_fov(160, 120, math.radians(60.0))
REFERENCE = load_plant("reference")
EXACT = with_options(
    REFERENCE,
    (
        ("camera.shutter", 0.0),
        ("camera.noise", 0.0),
        ("camera.exposure", 1.0),
        ("camera.white_balance", 1.0),
        ("camera.vignette", (0.0, 0.0)),
    ),
)
"""The real robot with perfect images."""
GREY = np.full((120, 160, 3), 120, dtype=np.uint8)


def make_world(
    engine: str, settings: CameraSettings | None = SETTINGS, *, exact: bool = True
) -> World:
    pytest.importorskip(engine)
    plant = EXACT if exact else REFERENCE
    try:
        return World(
            plant, [RobotSpec(load_robot())], engine=engine, cameras=settings, ball=BALL
        )
    except NaoGaitError as error:
        if error.field == "cameras":
            pytest.skip(f"no images here: {error.allowed}")
        raise


@pytest.fixture(scope="module", params=ENGINES)
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    with make_world(request.param) as world:
        yield world


def run(world: World, steps: int) -> list[tuple[int, int, CameraImage]]:
    """Time [ms] from the start when each image can first be used, camera, image."""
    start = world.time
    found: list[tuple[int, int, CameraImage]] = []
    newest: list[CameraImage | None] = [None] * len(world.robot.cameras)
    for _ in range(steps):
        world.step()
        for index, image in enumerate(world.robot.images()):
            if image is not None and image is not newest[index]:
                newest[index] = image
                found.append(((world.time - start) // 1_000_000, index, image))
    return found


def sphere(view: CameraView, centre: FloatArray, radius: float) -> NDArray[np.bool_]:
    """(h, w): whether the ray of each pixel meets a sphere."""
    pinhole = view.intrinsics
    pixels = np.stack(np.meshgrid(np.arange(pinhole.width), np.arange(pinhole.height)), axis=-1)
    rays = view.rays(pixels)
    to = centre - view.pose.position
    along = rays @ to / np.linalg.norm(rays, axis=-1)
    hit: NDArray[np.bool_] = (along > 0.0) & (to @ to - along**2 < radius**2)
    return hit


# -- geometry --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("camera", "place"), [(1, (0.42, 0.16)), (1, (0.6, -0.25)), (0, (1.5, 0.3)), (0, (1.8, -0.6))]
)
def test_the_ball_is_where_the_camera_model_puts_it(
    world: World, camera: int, place: tuple[float, float]
) -> None:
    """The pixels of the ball are those whose rays meet it, to a fraction of a pixel."""
    images, masks = [], []
    for x, y in (place, (-5.0, 0.0)):
        world.reset()
        world.put_ball(x, y)
        image = None
        while image is None:
            world.step()
            image = world.robot.images()[camera]
        assert world.ball is not None
        assert image.stamp == world.time
        images.append(image.pixels.astype(int))
        view = world.robot.cameras[camera].view(world.robot.state)
        masks.append(sphere(view, world.ball.position, BALL.radius))
    rendered = np.abs(images[0] - images[1]).max(axis=-1) > 3
    assert masks[0].sum() > 50
    assert (rendered & masks[0]).sum() > 0.85 * (rendered | masks[0]).sum()
    for drawn, expected in zip(np.nonzero(rendered), np.nonzero(masks[0]), strict=True):
        assert drawn.mean() == pytest.approx(expected.mean(), abs=0.25)


# -- time ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
def test_images_come_at_their_own_rate_and_late(engine: str) -> None:
    """The cameras alternate; a stamp is the time of the exposure."""
    with make_world(engine, SETTINGS.replace(rate=12.5, delay=0.05, width=32, height=24)) as world:
        run(world, 7)
        world.reset()
        start = world.time // 1_000_000
        found = run(world, 26)
    stamps = [(image.stamp // 1_000_000 - start, index) for _, index, image in found]
    assert stamps == [(40, 1), (80, 0), (120, 1), (160, 0), (200, 1)]
    assert [at - stamp for (at, _, _), (stamp, _) in zip(found, stamps, strict=True)] == [50] * 5


def test_a_camera_that_is_not_enabled_renders_nothing_and_keeps_its_times() -> None:
    settings = SETTINGS.replace(width=16, height=16)
    _, camera = make_cameras(load_robot(), EXACT, settings, seed=0, noise_seed=0)
    with make_world("pybullet", None) as world:
        state = world.robot.state
    rendered = []

    def render(view: CameraView) -> RgbImage:
        rendered.append(view)
        return np.zeros((16, 16, 3), dtype=np.uint8)

    camera.restart(0)
    stamps = []
    for time in range(0, 500_000_000, 10_000_000):
        camera.enabled = not 100_000_000 < time < 300_000_000
        camera.observe(time, state, render)
        image = camera.newest(time)
        if image is not None and image.stamp not in stamps:
            stamps.append(image.stamp)
    assert [stamp // 1_000_000 for stamp in stamps] == [50, 350, 450]
    assert len(rendered) == 3


def test_a_rate_between_control_periods_is_kept_in_the_mean() -> None:
    with make_world("pybullet", SETTINGS.replace(rate=30.0, width=16, height=16)) as world:
        found = [image.stamp for _, index, image in run(world, 101) if index == 0]
    gaps = np.diff(found) // 10_000_000
    assert set(gaps.tolist()) == {3, 4}
    assert len(found) == 30


def test_the_image_is_that_of_its_stamp() -> None:
    """A ball that is moved after the exposure stays where it was in a delayed image."""
    shown = []
    for later in ((0.42, 0.16), (-5.0, 0.0)):
        with make_world("pybullet", SETTINGS.replace(delay=0.1)) as world:
            world.put_ball(0.42, 0.16)
            for _ in range(5):
                world.step()
            world.put_ball(*later)
            _, index, image = run(world, 10)[0]
            shown.append(image.pixels)
            assert (index, image.stamp) == (1, 50_000_000)
    assert np.array_equal(*shown)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_same_world_gives_the_same_images(engine: str) -> None:
    with make_world(engine, exact=False) as first, make_world(engine, exact=False) as second:
        once, twice = run(first, 20), run(second, 20)
        assert len(once) == len(twice) == 4
        for (_, _, a), (_, _, b) in zip(once, twice, strict=True):
            assert a.stamp == b.stamp
            assert np.array_equal(a.pixels, b.pixels)


@pytest.mark.parametrize("engine", ENGINES)
def test_cameras_change_nothing_else(engine: str) -> None:
    """The robot moves bit by bit as without them, and senses the same."""
    results = []
    for settings in (None, SETTINGS):
        with make_world(engine, settings, exact=False) as world:
            for _ in range(25):
                world.step()
            truth, frame = world.robot.truth(), world.robot.sense()
            assert frame is not None
            results.append(
                (*truth[1:4], truth.joint_position, frame.angular_velocity, frame.joint_position)
            )
    for without, with_cameras in zip(*results, strict=True):
        assert np.array_equal(without, with_cameras)


# -- effects ---------------------------------------------------------------------------------------


def effects(plant: CameraPlant, seed: int = 3, camera: str = "camera_top") -> ImageEffects:
    return ImageEffects(plant, camera, seed, 0, PINHOLE)


def test_perfect_images_are_left_alone() -> None:
    assert np.array_equal(effects(EXACT.camera).apply(GREY, 0), GREY)


def test_noise_has_its_size_and_changes_from_image_to_image() -> None:
    noisy = effects(EXACT.camera.replace(noise=5.0))
    first, second = (noisy.apply(GREY, stamp).astype(float) for stamp in (1, 2))
    assert first.mean() == pytest.approx(120.0 - 0.5, abs=0.1)  # rounded down
    assert first.std() == pytest.approx(5.0, rel=0.05)
    assert np.corrcoef(first.ravel(), second.ravel())[0, 1] == pytest.approx(0.0, abs=0.02)
    assert np.array_equal(noisy.apply(GREY, 1), first)


def test_the_corners_are_darker() -> None:
    image = effects(EXACT.camera.replace(vignette=[0.3, 0.3])).apply(GREY, 0)[..., 0]
    assert image[60, 80] == pytest.approx(120, abs=1)
    assert image[0, 0] == image[-1, -1] == pytest.approx(0.7 * 120, abs=1)
    assert (np.diff(image[60, 80:].astype(int)) <= 0).all()


def test_motion_blurs_along_the_way_and_keeps_the_middle() -> None:
    image = np.zeros((60, 80, 3), dtype=np.uint8)
    image[30, 40] = 250
    for motion in ((6.0, 0.0), (0.0, -6.0), (8.0, 4.0)):
        spread = blurred(image, motion)[..., 0].astype(float)
        rows, columns = np.nonzero(spread)
        assert np.average(columns, weights=spread[rows, columns]) == pytest.approx(40.0, abs=0.2)
        assert np.average(rows, weights=spread[rows, columns]) == pytest.approx(30.0, abs=0.2)
        assert np.ptp(columns) == pytest.approx(abs(motion[0]), abs=1)
        assert np.ptp(rows) == pytest.approx(abs(motion[1]), abs=1)
        assert spread.sum() == pytest.approx(250.0, rel=0.05)
    assert blurred(image, (0.3, -0.4)) is image


def test_a_turning_head_blurs_the_image() -> None:
    """What is ahead moves by the focal length times the angle that the head turns meanwhile."""
    robot = load_robot()
    shutter, speed = 0.02, 1.5
    plant = with_options(EXACT, (("camera.shutter", shutter),))
    _, camera = make_cameras(robot, plant, SETTINGS, seed=0, noise_seed=0)
    edge = np.zeros((120, 160, 3), dtype=np.uint8)
    edge[:, 80:] = 200
    with make_world("pybullet", None) as world:
        state = world.robot.state
    widths = []
    for pan in (0.0, speed):
        velocity = np.zeros_like(state.joint_velocity)
        velocity[robot.index("HeadYaw")] = pan
        camera.restart(0)
        camera.observe(1_000_000_000, state._replace(joint_velocity=velocity), lambda _: edge)
        image = camera.newest(1_000_000_000)
        assert image is not None
        row = image.pixels[10, :, 0]
        widths.append(np.count_nonzero((row > 0) & (row < 200)))
    still, turning = widths
    assert still == 0
    # The lower camera looks down by 40 degrees, so a pan moves less of its image.
    expected = camera.model.intrinsics.fx * speed * shutter * math.cos(math.radians(39.0))
    assert turning == pytest.approx(expected, abs=1.5)


def test_each_camera_of_each_robot_has_its_own_exposure_and_white_balance() -> None:
    plant = REFERENCE.camera.replace(noise=0.0, vignette=[0.0, 0.0])
    means = np.array(
        [
            effects(plant, seed, camera).apply(GREY, 0).mean(axis=(0, 1))
            for seed in range(100)
            for camera in ("camera_top", "camera_bottom")
        ]
    )
    assert len(np.unique(means, axis=0)) > 150
    red, green, blue = (means / 120.0).T
    assert green.min() == pytest.approx(1.0 / plant.exposure, abs=0.02)
    assert green.max() == pytest.approx(plant.exposure, abs=0.02)
    for ratio in (red / green, blue / green):
        assert 1.0 / plant.white_balance - 0.02 < ratio.min() < 0.95
        assert 1.05 < ratio.max() < plant.white_balance + 0.02
    assert abs(np.corrcoef(means[::2, 1], means[1::2, 1])[0, 1]) < 0.3


def test_mounting_turns_each_camera_and_moves_none() -> None:
    robot = load_robot("nao_h21_v33")
    loose = with_options(REFERENCE, (("camera.mounting", 0.01),))
    with make_world("pybullet") as world:
        state = world.robots[0].state
    body = state.joint_position, state.torso_position, state.torso_matrix
    turns = []
    for seed in range(40):
        for camera in make_cameras(robot, loose, SETTINGS, seed=seed, noise_seed=0):
            nominal = camera.model.view(*body).pose
            seen = camera.view(state).pose
            assert np.array_equal(seen.position, nominal.position)
            relative = nominal.rotation.T @ seen.rotation
            turns.append((relative[2, 1], relative[0, 2], relative[1, 0]))
    assert np.std(turns, axis=0) == pytest.approx(0.01, rel=0.3)
    (exact, *_) = make_cameras(robot, REFERENCE, SETTINGS, seed=3, noise_seed=0)
    assert np.array_equal(exact.view(state).pose.rotation, exact.model.view(*body).pose.rotation)


def test_white_stays_white() -> None:
    bright = effects(REFERENCE.camera.replace(noise=60.0))
    image = bright.apply(np.full_like(GREY, 255), 0)
    assert image.max() == 255
    assert np.median(image[60, 60:100]) > 180, "no overflow"


# -- what is refused -------------------------------------------------------------------------------


def test_a_robot_without_cameras_is_refused(tmp_path: Path) -> None:
    blind = load_robot().urdf.replace("_optical_frame", "_frame")
    path = tmp_path / "blind.urdf"
    path.write_text(blind, encoding="utf-8")
    with pytest.raises(NaoGaitError, match=r"cameras: .*blind.urdf has no optical frame"):
        World(REFERENCE, [RobotSpec(load_robot(path))], cameras=SETTINGS)


def test_settings_out_of_range_are_refused() -> None:
    for key, value in (("rate", 0.0), ("width", 4), ("height", 9999), ("delay", -0.1)):
        with pytest.raises(NaoGaitError, match=key):
            SETTINGS.replace(**{key: value})


def test_missing_opengl_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(ctypes.util, "find_library", lambda _: None)
    with pytest.raises(NaoGaitError, match="apt-get install libegl1") as caught:
        World(REFERENCE, [RobotSpec(load_robot())], engine="mujoco", cameras=SETTINGS)
    assert "\n" not in str(caught.value)


def test_shapes_out_of_view_change_no_image(monkeypatch: pytest.MonkeyPatch) -> None:
    from sim_bridge.engines.mujoco.pictures import MujocoPictures

    world = World.of_scene(
        load_scene("pitch_small"), REFERENCE, engine="mujoco", cameras=CameraSettings()
    )
    with world:
        views = [camera.view(robot.state) for robot in world.robots for camera in robot.cameras]
        fast = [world.render(view) for view in views]
        shown: list[NDArray[np.bool_]] = []

        def everything(
            pictures: MujocoPictures, data: object, view: CameraView
        ) -> NDArray[np.bool_]:
            shown.append(in_view(pictures, data, view))
            return np.ones_like(shown[-1])

        in_view = MujocoPictures._in_view
        monkeypatch.setattr(MujocoPictures, "_in_view", everything)
        for view, image in zip(views, fast, strict=True):
            assert np.array_equal(world.render(view), image)
        assert all(each.any() for each in shown)
        assert any(each.mean() < 0.5 for each in shown)
