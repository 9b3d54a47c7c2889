"""`nao_gait vision sheet`: what vision finds in images of both engines, light and dark."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from gait_lab.vision.evaluate import BRIGHTNESS, Viewer
from gait_lab.vision.rendered_frames import RenderedFrame, rendered_frames
from gait_lab.vision.viewing_walks import random_walk
from nao_soccer.vision.colors import Image
from nao_soccer.vision.debug_image import draw_debug_image
from nao_soccer.vision.percepts import Percepts

URDF = "nao_h21_v33"
SECONDS = 3.0
"""[s] of each walk, of which one image is shown."""
TILE = (480, 360)
"""[px] Width and height of an image on the sheet."""
QUALITY = 80
"""Of the JPEG."""


class Tile(NamedTuple):
    """An image of the sheet.

    Attributes:
        kind: How it walks; see `walks.KINDS`.
    """

    engine: str
    seed: int
    kind: str
    brightness: float


DARK, USUAL, LIGHT = BRIGHTNESS
TILES = (
    Tile("mujoco", 5, "stand", USUAL), Tile("mujoco", 4, "stand", DARK),
    Tile("mujoco", 2, "walk", LIGHT), Tile("pybullet", 3, "walk", USUAL),
    Tile("pybullet", 1, "sweep", LIGHT), Tile("pybullet", 2, "walk", DARK),
)  # fmt: skip


def draw(tile: Tile, seen: Iterable[RenderedFrame]) -> Image:
    """The image of a walk in which most kinds of objects are found, with all percepts."""
    viewer = Viewer(tile.brightness)
    best, picture = -1, np.zeros((TILE[1], TILE[0], 3), dtype=np.uint8)
    for each in seen:
        percepts = viewer.see(each)
        value = _value(percepts)
        if value > best and viewer.frame is not None:
            # The image as it came, not as vision has balanced it.
            best, picture = value, draw_debug_image(viewer.frame, percepts, image=viewer.image)
    picture = np.asarray(cv2.resize(picture, TILE, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    text = f"{tile.engine}, {tile.kind}, brightness x {tile.brightness:g}"
    place, white = (6, TILE[1] - 8), (255, 255, 255)
    cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, white, 1, cv2.LINE_AA)
    return picture


def _value(percepts: Percepts) -> int:
    """Kinds of objects in an image, and their number to decide between equal ones."""
    kinds = {each.kind for each in percepts.objects}
    return 20 * (len(kinds) + (percepts.ball is not None)) + len(percepts.objects)


def write_sheet(out: Path, say: Callable[[str], None]) -> None:
    """Render all walks and write the sheet."""
    walks = [random_walk(tile.seed, tile.kind, tile.engine, SECONDS, URDF) for tile in TILES]
    pairs = zip(TILES, walks, strict=True)
    write([draw(tile, rendered_frames(walk)) for tile, walk in pairs], out)
    say(f"written: {out}")


def write(tiles: Sequence[Image], path: Path) -> None:
    """Write images (h, w, 3) in rows of three."""
    rows = [np.hstack(tiles[first : first + 3]) for first in range(0, len(tiles), 3)]
    sheet = cv2.cvtColor(np.vstack(rows), cv2.COLOR_RGB2BGR)
    _, data = cv2.imencode(".jpg", sheet, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data.tobytes())
