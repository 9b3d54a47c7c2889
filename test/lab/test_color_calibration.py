"""Colour tables from images: drawn pitches of any exposure, and images that cannot be used."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_lab import cli
from gait_lab.vision.color_calibration import Sample, calibrate_colors
from nao_soccer.vision.colors import (
    BALL,
    FIELD,
    WHITE,
    ColorClassifier,
    ColorTable,
    load_color_table,
)
from nao_soccer.vision.detector import Vision
from nao_soccer.vision.settings import VisionSettings
from pitch_image import camera, picture
from robot_core.errors import NaoGaitError

BASE = load_color_table("pitch")
SPOTS = [(x, 0.3 * index, 0.5 * index - 0.7) for index, x in enumerate((-3.0, -2.0, -1.0, 0.0))]
"""x, y [m], heading [rad] of the cameras."""


def images(brightness: float = 1.0, count: int = len(SPOTS)) -> list[np.ndarray]:
    """Pictures with the ball 1.3 m ahead."""
    spots = SPOTS[:count]
    views = [camera(*spot) for spot in spots]
    balls = [(x + 1.3 * np.cos(turn), y + 1.3 * np.sin(turn)) for x, y, turn in spots]
    return [
        picture(view, ball, brightness=brightness, seed=seed)
        for seed, (view, ball) in enumerate(zip(views, balls, strict=True))
    ]


def error(table: ColorTable, brightness: float, distance: float) -> float:
    """Distance [m] of the ball that is found from where it is; infinite without one."""
    view = camera(-3.0, 0.3, 0.2)
    ball = (-3.0 + distance * np.cos(0.25), 0.3 + distance * np.sin(0.25))
    image = picture(view, ball, brightness=brightness, seed=9)
    found = Vision(table, VisionSettings()).see(0, image, view).ball
    return np.inf if found is None else float(np.hypot(*np.subtract(found.position, ball)))


@pytest.mark.parametrize("brightness", [0.6, 1.0, 1.4])
def test_a_table_finds_the_ball_as_well_as_the_shipped_one(brightness: float):
    table = calibrate_colors(images(brightness), BASE).table
    for distance in (1.2, 2.0, 3.0):
        own, shipped = (error(each, brightness, distance) for each in (table, BASE))
        assert own <= max(shipped, 0.02 * distance)


def test_the_table_is_that_of_the_paint_and_tells_what_it_has_not_seen():
    found = calibrate_colors(images(), BASE)
    assert found.pixels["ball"] > 100
    assert found.pixels["blue"] == found.pixels["red"] == 0
    assert found.table.blue == BASE.blue
    paint = np.array([[(26, 115, 41), (242, 242, 242), (242, 115, 13)]], np.uint8)
    classes = ColorClassifier(found.table)
    classes.adapt(images(count=1)[0], 120)
    seen = classes.classify(classes.balance(paint))
    assert seen.tolist() == [[FIELD, WHITE, BALL]]


def test_a_sample_names_a_ball_of_another_colour():
    pink, found = (240, 60, 170), images()
    for image in found:
        image[np.abs(image.astype(int) - (242, 115, 13)).sum(axis=-1) < 60] = pink
    rows, columns = np.nonzero((found[0] == pink).all(axis=-1))
    box = (int(columns.min()), int(rows.min()), int(columns.max()), int(rows.max()))
    table = calibrate_colors(found, BASE, [Sample("ball", 0, box)]).table
    colors = ColorClassifier(table)
    colors.adapt(found[0], 120)
    pixels = colors.balance(np.array([[pink, (242, 115, 13)]], np.uint8))
    assert (colors.classify(pixels) == BALL).tolist() == [[True, False]]


@pytest.mark.parametrize(
    ("pictures", "samples", "reason"),
    [
        ([], (), "images: got 'none'"),
        ([np.zeros((8, 8, 3), np.uint8)], (), "image 0: got '8 x 8'; allowed: at least 32 x 32"),
        ([np.full((240, 320, 3), 90, np.uint8)], (), "field: got 'no colour that covers more than"),
        ([np.full((240, 320, 3), (30, 140, 50), np.uint8)], (), "white: got '0 pixels'"),
        (None, [Sample("net", 0, (0, 0, 5, 5))], "sample: got 'net'; allowed: one of ball"),
        (None, [Sample("ball", 3, (0, 0, 5, 5))], "sample ball: got 'image 3'"),
        (None, [Sample("ball", 0, (0, 0, 500, 5))], "sample ball: got .*320 x 240"),
        (None, [Sample("ball", 0, (0, 225, 40, 239))], "sample ball: got '0 pixels'"),
    ],
)
def test_images_that_cannot_be_used_are_one_line(
    pictures: list[np.ndarray] | None, samples: list[Sample], reason: str
):
    """None: a usual picture."""
    pictures = images(count=1) if pictures is None else pictures
    with pytest.raises(NaoGaitError, match=reason) as refusal:
        calibrate_colors(pictures, BASE, samples)
    assert "\n" not in str(refusal.value)


def test_the_tool_writes_a_table_and_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    folder, out = tmp_path / "images", tmp_path / "colors.yaml"
    folder.mkdir()
    for index, image in enumerate(images(0.8)):
        cv2.imwrite(str(folder / f"{index}.png"), image[..., ::-1])
    assert cli.main(["vision", "calibrate", str(folder), "-o", str(out)]) == 0
    said = capsys.readouterr().out
    assert re.search(r"ball +hue \S+ +\d+ pixels", said)
    assert re.search(r"blue +hue 195-255 +not in the images; as in pitch", said)
    assert error(load_color_table(out), 0.8, 2.0) < 0.05
    assert cv2.imread(str(out.with_suffix(".png"))).shape == (4 * 240, 640, 3)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["nowhere"], "source: got 'nowhere'; allowed: a bag, a folder of PNG images, or a scene"),
        (["images", "--sample", "ball", "0", "a", "0", "1", "1"], "sample: got 'ball 0 a 0 1 1'"),
        (["images"], "0.png: got 'unreadable'; allowed: a PNG image"),
        (["empty"], "bag: got .*an empty folder"),
    ],
)
def test_a_source_that_cannot_be_used_is_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    reason: str,
):
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "0.png").write_text("no image")
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path)
    assert cli.main(["vision", "calibrate", *arguments]) == 2
    said = capsys.readouterr().err
    assert re.search(reason, said), said
    assert len(said.splitlines()) == 1
