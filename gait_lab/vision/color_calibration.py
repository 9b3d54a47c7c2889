"""Makes a colour table from images of the place where the robots play.

The field is the dominant saturated hue in the lower half of the images, the lines are what is
bright and achromatic between two pieces of it. Each image is balanced by its own field first, as
`ColorClassifier` does it, so that images of different exposure count alike. Ball, teams and goals
are saturated regions next to the hues of a base table, or what the user has marked.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import attrs
import cv2
import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.colors import (
    CLASSES,
    ColorClassifier,
    ColorRange,
    ColorTable,
    Image,
    to_hsv,
)
from robot_core.errors import NaoGaitError
from robot_core.types import FloatArray

SIZE_MIN = 32
"""[px] Smallest width or height of an image."""
COLORED = (0.25, 0.08)
"""Least saturation and value of a pixel with a hue."""
FIELD_SHARE = 0.25
"""Least share of the field in the lower halves of all images."""
HUE_BIN = 5.0
"""[deg] of the histogram that finds the field."""
FIELD_HUES = 30.0
"""[deg] to either side of the field's hue, in images as they are."""
FIELD_LEVEL = 140.0
"""Brightest channel of the field in the table; fixed, so that dark images keep their resolution."""
LINE_WIDTH = 15
"""[px] Widest line that is looked at."""
LINE_SATURATION = 0.5
"""Largest saturation of a line, of the field's."""
WHITE_LEVEL = 0.6
"""Least value of white, of the field's: goals may be in the shade."""
PIXELS_MIN = 80
"""Least number of pixels of a class in all images; with fewer the base table's range is kept."""
SAMPLE_MIN = 10
"""Least number of pixels that a sample marks."""
VIVID = (0.45, 0.12)
"""Least saturation and value of ball, teams and goals."""
REACH = 15.0
"""[deg] by which a colour may lie beside its range in the base table."""
TAILS = (2.0, 98.0)
"""Percentiles of a class between which its range is measured."""
SLACK = 6.0
"""[deg] added to a range of hues on either side."""
LEVEL_SLACK = 0.6
"""Least saturation and value of a range, of the lower percentile."""
COLORS = ("ball", "red", "blue", "yellow")
"""Classes with a hue of their own besides the field."""


class Sample(NamedTuple):
    """A rectangle of an image that shows one class, and perhaps some field.

    Attributes:
        name: Class, one of `CLASSES`.
        image: Number of the image, counted from 0.
        box: First column, first row, last column, last row [px].
    """

    name: str
    image: int
    box: tuple[int, int, int, int]


@dataclass(frozen=True, slots=True)
class CalibratedColors:
    """A colour table and what it is made of.

    Attributes:
        pixels: Number of pixels by class; 0 = the range of the base table.
    """

    table: ColorTable
    pixels: Mapping[str, int]


class _Arc(NamedTuple):
    """A range of hues [deg]: its centre, and its width to either side."""

    centre: float
    low: float
    high: float

    @classmethod
    def of(cls, hue: tuple[float, float]) -> "_Arc":
        width = (hue[1] - hue[0]) % 360.0
        return cls((hue[0] + 0.5 * width) % 360.0, 0.5 * width, 0.5 * width)

    @property
    def hue(self) -> tuple[float, float]:
        ends = ((self.centre - self.low) % 360.0, (self.centre + self.high) % 360.0)
        return round(ends[0], 1), round(ends[1], 1)


def calibrate_colors(
    images: Sequence[Image], base: ColorTable, samples: Sequence[Sample] = ()
) -> CalibratedColors:
    """Make a colour table of images (height, width, 3), red, green, blue, that show the field.

    The base table keeps its ranges for classes that no image shows; samples replace the search.

    Raises:
        NaoGaitError: The images show no field or no lines, or a sample is not usable.
    """
    if not images:
        raise NaoGaitError("images", "none", "at least one")
    for index, image in enumerate(images):
        if min(image.shape[:2]) < SIZE_MIN:
            size = f"{image.shape[1]} x {image.shape[0]}"
            raise NaoGaitError(f"image {index}", size, f"at least {SIZE_MIN} x {SIZE_MIN} px")
    for sample in samples:
        _check_sample(sample, images)
    base = _with_field(images, base, samples)
    balanced = [_balanced(image, base) for image in images]
    hsv = [to_hsv(image).reshape(image.shape) for image in balanced]
    grounds = [_contains(base.field_search, each) for each in hsv]
    if not any(each.any() for each in grounds):
        raise NaoGaitError("field", "lost in the balanced images", "images of one place")
    ground = np.concatenate([each[mask] for each, mask in zip(hsv, grounds, strict=True)])
    marked = {name: _marked(name, samples, hsv, grounds) for name in CLASSES}
    lines = marked["white"]
    if lines is None:
        level = np.median(ground, axis=0)
        lines = np.concatenate(
            [_lines(each, mask, level) for each, mask in zip(hsv, grounds, strict=True)]
        )
    if len(lines) < PIXELS_MIN:
        allowed = f"at least {PIXELS_MIN} pixels of field lines, or a sample of white"
        raise NaoGaitError("white", f"{len(lines)} pixels", allowed)
    table, pixels = _grounds(base, ground, lines)
    found = _vivid(base, hsv, grounds, marked)
    return _with_colors(table, found, pixels)


def _check_sample(sample: Sample, images: Sequence[Image]) -> None:
    where = f"sample {sample.name}"
    if sample.name not in CLASSES:
        raise NaoGaitError("sample", sample.name, CLASSES)
    if not 0 <= sample.image < len(images):
        raise NaoGaitError(where, f"image {sample.image}", f"0 to {len(images) - 1}")
    height, width = images[sample.image].shape[:2]
    left, top, right, bottom = sample.box
    if not (0 <= left <= right < width and 0 <= top <= bottom < height):
        allowed = f"X0 Y0 X1 Y1 within {width} x {height} px, X0 <= X1, Y0 <= Y1"
        raise NaoGaitError(where, sample.box, allowed)


def _contains(colors: ColorRange, hsv: FloatArray) -> NDArray[np.bool_]:
    """(height, width) which pixels lie in a range."""
    return colors.contains(hsv.reshape(-1, 3)).reshape(hsv.shape[:2])


# -- field and lines -------------------------------------------------------------------------------


def _with_field(images: Sequence[Image], base: ColorTable, samples: Sequence[Sample]) -> ColorTable:
    """The base table with the colour of the field of these images as they are."""
    lower = np.concatenate([image[len(image) // 2 :].reshape(-1, 3) for image in images])
    marked = [sample for sample in samples if sample.name == "field"]
    shown = lower
    if marked:
        shown = np.concatenate([_cut(images[each.image], each.box) for each in marked])
    hsv = to_hsv(shown)
    colored = (hsv[:, 1] >= COLORED[0]) & (hsv[:, 2] >= COLORED[1])
    best = _dominant_hue(hsv[colored, 0])
    search = ColorRange(
        hue=_Arc(best, FIELD_HUES, FIELD_HUES).hue, saturation=(COLORED[0], 1.0),
        value=(COLORED[1], 1.0),
    )  # fmt: skip
    inside = search.contains(hsv)
    share = float(search.contains(to_hsv(lower)).mean())
    if share < FIELD_SHARE:
        got = f"no colour that covers more than {share:.0%} of the lower halves"
        allowed = f"images whose lower halves show the field on {FIELD_SHARE:.0%} or more"
        raise NaoGaitError("field", got, allowed)
    color = np.median(shown[inside], axis=0)
    color = np.clip(np.rint(color * FIELD_LEVEL / max(float(color.max()), 1.0)), 1.0, 255.0)
    red, green, blue = color.tolist()
    return attrs.evolve(base, field_color=(red, green, blue), field_search=search)


def _dominant_hue(hues: FloatArray) -> float:
    """The hue [deg] around which most of these are."""
    count, edges = np.histogram(hues, bins=round(360.0 / HUE_BIN), range=(0.0, 360.0))
    around = count + np.roll(count, 1) + np.roll(count, -1)
    return float(edges[around.argmax()]) + 0.5 * HUE_BIN


def _balanced(image: Image, table: ColorTable) -> Image:
    """An image with its field in the colour of the table."""
    classifier = ColorClassifier(table)
    classifier.adapt(image, image.shape[0] // 2)
    return classifier.balance(image)


def _lines(hsv: FloatArray, ground: NDArray[np.bool_], field: FloatArray) -> FloatArray:
    """Colours (n, 3) of what is narrow, achromatic and brighter than the field, on the field.

    `hsv` (height, width, 3) is balanced; `ground` (height, width) says where the field is, `field`
    (3,) its usual colour.
    """
    mask = ground.astype(np.uint8)
    narrow = np.zeros_like(ground)
    for size in ((1, LINE_WIDTH), (LINE_WIDTH, 1)):
        closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones(size, np.uint8))
        narrow |= closed.astype(bool) & ~ground
    _, saturation, value = field
    narrow &= (hsv[..., 1] <= LINE_SATURATION * saturation) & (hsv[..., 2] >= value)
    return np.asarray(hsv[narrow])


def _grounds(
    base: ColorTable, ground: FloatArray, lines: FloatArray
) -> tuple[ColorTable, dict[str, int]]:
    """The table with field and white."""
    arc = _arc(ground[:, 0])
    _, tail, _ = np.percentile(ground, TAILS[0], axis=0)
    split = round(float(0.5 * (np.percentile(lines[:, 1], 75.0) + tail)), 3)
    low, level, high = np.percentile(ground[:, 2], (TAILS[0], 50.0, TAILS[1])).tolist()
    table = attrs.evolve(
        base,
        field=ColorRange(
            hue=arc.hue, saturation=(split, 1.0),
            value=(round(LEVEL_SLACK * low, 3), round(min(high / LEVEL_SLACK, 1.0), 3)),
        ),
        white=ColorRange(saturation=(0.0, split), value=(round(WHITE_LEVEL * level, 3), 1.0)),
    )  # fmt: skip
    return table, {"field": len(ground), "white": len(lines)}


def _arc(hues: FloatArray) -> _Arc:
    """Where hues [deg] lie, with some slack; around their circular mean."""
    angle = np.radians(hues)
    centre = float(np.degrees(np.arctan2(np.sin(angle).mean(), np.cos(angle).mean())))
    off = (hues - centre + 180.0) % 360.0 - 180.0
    low, high = np.percentile(off, TAILS).tolist()
    return _Arc(centre % 360.0, SLACK - low, SLACK + high)


# -- ball, teams, goals ----------------------------------------------------------------------------


def _cut(image: NDArray[Any], box: tuple[int, int, int, int]) -> NDArray[Any]:
    """The pixels of a rectangle, one after the other."""
    left, top, right, bottom = box
    return image[top : bottom + 1, left : right + 1].reshape(-1, *image.shape[2:])


def _marked(
    name: str,
    samples: Sequence[Sample],
    hsv: Sequence[FloatArray],
    grounds: Sequence[NDArray[np.bool_]],
) -> FloatArray | None:
    """Colours (n, 3) that the user has marked for a class; None without a sample."""
    chosen = [each for each in samples if each.name == name]
    if not chosen:
        return None
    colors = np.concatenate(
        [
            _cut(hsv[each.image], each.box)[
                (name == "field") | ~_cut(grounds[each.image], each.box)
            ]
            for each in chosen
        ]
    )
    if len(colors) < SAMPLE_MIN:
        allowed = f"at least {SAMPLE_MIN} pixels that are not field"
        raise NaoGaitError(f"sample {name}", f"{len(colors)} pixels", allowed)
    if name in COLORS:
        # Not the edge, where the colour is mixed with that of the field.
        best = _dominant_hue(colors[:, 0])
        colors = colors[_beside(_Arc(best, REACH, REACH), colors[:, 0]) <= 0.0]
    return np.asarray(colors, dtype=float)


def _vivid(
    base: ColorTable,
    hsv: Sequence[FloatArray],
    grounds: Sequence[NDArray[np.bool_]],
    marked: Mapping[str, FloatArray | None],
) -> dict[str, FloatArray]:
    """Colours (n, 3) of each class with a hue: each vivid pixel counts for the nearest one."""
    given = {name: colors for name in COLORS if (colors := marked[name]) is not None}
    arcs = [
        _arc(given[name][:, 0]) if name in given else _Arc.of(getattr(base, name).hue)
        for name in COLORS
    ]
    found: dict[str, list[FloatArray]] = {name: [] for name in COLORS}
    for image, ground in zip(hsv, grounds, strict=True):
        vivid = ~ground & (image[..., 1] >= VIVID[0]) & (image[..., 2] >= VIVID[1])
        off = np.stack([_beside(arc, image[..., 0]) for arc in arcs])
        nearest = np.where(vivid & (off.min(axis=0) <= REACH), off.argmin(axis=0), -1)
        for row, name in enumerate(COLORS):
            # The edge of a region has a mixture of its colour with what is beside it.
            inner = cv2.erode((nearest == row).astype(np.uint8), np.ones((3, 3), np.uint8))
            found[name].append(image[inner.astype(bool)])
    return {name: np.concatenate(colors) for name, colors in found.items()} | given


def _beside(arc: _Arc, hues: FloatArray) -> FloatArray:
    """How far [deg] hues lie beside a range; 0 within it."""
    side = (hues - arc.centre + 180.0) % 360.0 - 180.0
    return np.asarray(np.maximum(np.maximum(side - arc.high, -arc.low - side), 0.0))


def _with_colors(
    table: ColorTable, found: Mapping[str, FloatArray], pixels: Mapping[str, int]
) -> CalibratedColors:
    """The table with the ranges of the classes that are seen; ranges do not overlap."""
    counts = {name: len(colors) for name, colors in found.items()}
    seen = {name for name, count in counts.items() if count >= PIXELS_MIN}
    arcs = {"field": _Arc.of(table.field.hue)}
    for name in COLORS:
        arcs[name] = _arc(found[name][:, 0]) if name in seen else _Arc.of(getattr(table, name).hue)
    _separate(arcs, seen | {"field"})
    changes: dict[str, Any] = {}
    for name in ("field", *COLORS):
        old: ColorRange = getattr(table, name)
        saturation, value = old.saturation, old.value
        if name in seen:
            _, *lows = np.percentile(found[name], TAILS[0], axis=0).tolist()
            least_saturation, least_value = (round(LEVEL_SLACK * low, 3) for low in lows)
            saturation, value = (max(least_saturation, VIVID[1]), 1.0), (least_value, 1.0)
        changes[name] = ColorRange(hue=arcs[name].hue, saturation=saturation, value=value)
    numbers = {name: counts[name] if name in seen else 0 for name in COLORS}
    return CalibratedColors(attrs.evolve(table, **changes), {**pixels, **numbers})


def _separate(arcs: dict[str, _Arc], seen: set[str]) -> None:
    """Shorten overlapping ranges: the one that was not seen, or both by half."""
    for first in arcs:
        for second in arcs:
            a, b = arcs[first], arcs[second]
            apart = (b.centre - a.centre) % 360.0
            if first == second or apart >= 180.0:
                continue
            over = a.high + b.low - apart
            if over <= 0.0:
                continue
            share = 0.5 if (first in seen) == (second in seen) else float(second in seen)
            arcs[first] = a._replace(high=a.high - share * over)
            arcs[second] = b._replace(low=b.low - (1.0 - share) * over)
