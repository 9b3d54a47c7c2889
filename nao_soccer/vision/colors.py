"""Colour classes: a table of ranges of hue, saturation and value, and its lookup table.

The image is first scaled so that the green of the field has the brightness and the tint that the
table was made for: exposure and white balance of a camera are then taken out.
"""

from pathlib import Path
from typing import Any, Final

import attrs
import cv2
import numpy as np
from numpy.typing import NDArray

from robot_core import schema
from robot_core.resources import find
from robot_core.schema import Interval, Number, Sequence, Settings, group, number
from robot_core.types import FloatArray

Image = NDArray[np.uint8]
"""(height, width, 3): red, green, blue; or (height, width): one class per pixel."""

NONE, FIELD, WHITE, BALL, RED, BLUE, YELLOW = range(7)
"""Colour classes of a pixel."""
BITS = 6
"""Bits per channel of the lookup table."""
SAMPLE_STEP = 4
"""Every so many rows and columns are used to find the field's green."""
SAMPLES_MIN = 100
"""Least number of green samples from which the gains follow."""
GAIN_SHARE = 0.3
"""Share by which the gains follow in one image."""
GAIN_LIMITS = (0.4, 3.0)
"""Smallest and largest gain of green."""
SATURATED = 250
"""Red from which on a pixel is over-exposed: its hue has moved towards yellow."""
TINT_LIMITS = (0.75, 1.35)
"""Smallest and largest gain of red and blue, of that of green."""


@attrs.frozen
class ColorRange(Settings):
    """A range of colours; a hue that runs over 360 has low > high, as [340, 20]."""

    hue: tuple[float, float] = schema.field(
        Sequence(Number(0.0, 360.0, "deg"), 2, 2), (0.0, 360.0), "Hue, counted upwards."
    )
    saturation: tuple[float, float] = schema.field(
        Interval(Number(0.0, 1.0)), (0.0, 1.0), "Saturation."
    )
    value: tuple[float, float] = schema.field(
        Interval(Number(0.0, 1.0)), (0.0, 1.0), "Brightness of the brightest channel."
    )

    def contains(self, hsv: FloatArray) -> NDArray[np.bool_]:
        """Which colours (n, 3) of hue [deg], saturation and value lie in the range."""
        hue, saturation, value = hsv.T
        low, high = self.hue
        inside = (hue >= low) & (hue <= high) if low <= high else (hue >= low) | (hue <= high)
        for channel, (least, most) in ((saturation, self.saturation), (value, self.value)):
            inside &= (channel >= least) & (channel <= most)
        return np.asarray(inside)


@attrs.frozen
class ColorTable(Settings):
    """The colour classes of one place. Where two ranges overlap, the first one counts."""

    field_color: tuple[float, float, float] = schema.field(
        Sequence(Number(1.0, 255.0), 3, 3),
        meaning="Red, green, blue of the field for which the ranges hold.",
    )
    field_search: ColorRange = group(
        ColorRange, meaning="Range in which the field's green is searched in an image as it is."
    )
    ball: ColorRange = group(ColorRange, meaning="The ball.")
    red: ColorRange = group(ColorRange, meaning="Marks of the red team.")
    blue: ColorRange = group(ColorRange, meaning="Marks of the blue team.")
    yellow: ColorRange = group(ColorRange, meaning="Yellow goals and poles.")
    field: ColorRange = group(ColorRange, meaning="The field.")
    white: ColorRange = group(ColorRange, meaning="Lines and goals.")
    edge: float = number(
        0.25, 0.02, 1.0, "", "Least rise of brightness from the field to a line, of the field's."
    )


CLASSES: Final = {
    "ball": BALL,
    "red": RED,
    "blue": BLUE,
    "yellow": YELLOW,
    "field": FIELD,
    "white": WHITE,
}
"""Class of each range of a table, the first one that matches counts."""


def load_color_table(name_or_path: str | Path) -> ColorTable:
    """Load a table: a shipped name or the path of a YAML file.

    Raises:
        NaoGaitError: Names the file, the class, its value and what is allowed.
    """
    path = find("vision", name_or_path)
    return ColorTable.from_mapping(schema.read_yaml(path, "colour table"), f"colour table {path}: ")


def to_hsv(rgb: NDArray[Any]) -> FloatArray:
    """Hue [deg], saturation and value of colours (n, 3) from 0 to 255."""
    pixels = np.ascontiguousarray(rgb, dtype=np.float32).reshape(-1, 1, 3) / 255.0
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2HSV)).reshape(-1, 3).astype(float)


class ColorClassifier:
    """Gives each pixel its class.

    Args:
        table: The colour classes.
        yellow: Something on the field is yellow. Without, an over-exposed yellow pixel is orange.

    Attributes:
        gains: (3,) factors of red, green and blue that bring the field to its colour in the table.
    """

    def __init__(self, table: ColorTable, *, yellow: bool = True) -> None:
        self.gains = np.ones(3)
        self._yellow = yellow
        self._table = table
        self._known = False
        size = 1 << BITS
        level = (np.arange(size) + 0.5) * (256.0 / size)
        colors = np.stack(np.meshgrid(level, level, level, indexing="ij"), axis=-1).reshape(-1, 3)
        hsv = to_hsv(colors)
        lookup = np.full(size**3, NONE, dtype=np.uint8)
        for name, number_ in reversed(CLASSES.items()):
            lookup[getattr(table, name).contains(hsv)] = number_
        self._lookup = lookup

    def adapt(self, image: Image, below: int) -> None:
        """Follow the field's green in an image (height, width, 3), from the row `below` on."""
        samples = image[max(below, 0) :: SAMPLE_STEP, ::SAMPLE_STEP].reshape(-1, 3)
        if len(samples) < SAMPLES_MIN:
            return
        green = samples[self._table.field_search.contains(to_hsv(samples))]
        if len(green) < SAMPLES_MIN:
            return
        seen = np.maximum(np.median(green, axis=0), 1.0)
        gains = np.asarray(self._table.field_color) / seen
        bright = np.clip(gains[1], *GAIN_LIMITS)
        gains = bright * np.clip(gains / gains[1], *TINT_LIMITS)
        share = GAIN_SHARE if self._known else 1.0
        self.gains = self.gains + share * (gains - self.gains)
        self._known = True

    def balance(self, image: Image) -> Image:
        """The image (height, width, 3) with the field in its colour of the table."""
        level = np.arange(256.0)[:, None] * self.gains
        table = np.clip(np.rint(level), 0, 255).astype(np.uint8)
        return np.asarray(cv2.LUT(image, table[None]), dtype=np.uint8)

    def classify(self, balanced: Image, image: Image | None = None) -> Image:
        """Class of each pixel (height, width) of a balanced image.

        `image` is the same before it was balanced, to know what is over-exposed.
        """
        red, green, blue = cv2.split(balanced)
        shift = 8 - BITS
        index = ((red >> shift).astype(np.int32) << (2 * BITS)) | (
            (green >> shift).astype(np.int32) << BITS
        )
        index |= blue >> shift
        classes = self._lookup[index]
        if image is not None and not self._yellow:
            classes[(image[..., 0] >= SATURATED) & (classes == YELLOW)] = BALL
        return classes
