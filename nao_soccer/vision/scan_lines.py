"""Points on field lines: short bright runs between green on vertical and horizontal scan lines."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.colors import FIELD, Image
from nao_soccer.vision.frame import Frame
from robot_core.types import FloatArray

ROW_STEP, COLUMN_STEP = 2, 3
"""Rows and columns between two scan lines; a line that leads away is long in the world but short in
the image."""
WIDTH_MAX = 1.8
"""Longest run along a scan line, of the width of a line on the ground."""
SLACK = 2.5
"""[px] by which a run may be longer, for the blur of both edges."""
GUARD = 3
"""Pixels on either side of a run that are to be green."""
GUARD_GREEN = 2
"""Least number of green ones among them."""
CONTRAST = 0.7
"""Least mean rise of brightness of a run over both sides, of the least rise of `bright`."""
REACH_MAX = 6.0
"""[m] Largest distance of a point."""


class LinePoints(NamedTuple):
    """Points on the middle of field lines.

    Attributes:
        pixels: (n, 2) columns and rows.
        places: (n, 2) [m] in base_footprint.
    """

    pixels: FloatArray
    places: FloatArray


def bright(frame: Frame, edge: float) -> NDArray[np.bool_]:
    """(height, width) Pixels on the field that are whiter than it, at least in part."""
    field = frame.whiteness[frame.classes == FIELD]
    level = float(np.median(field)) if field.size else 255.0
    mask = frame.whiteness > level + edge * (255.0 - level)
    rows = np.arange(len(mask))[:, None]
    return np.asarray(mask & (rows >= frame.boundary_row))


def find_line_points(
    frame: Frame, mask: NDArray[np.bool_], free: NDArray[np.bool_], edge: float, line_width: float
) -> LinePoints:
    """All points of an image; `free` (height, width) is false where no line can be seen."""
    green = frame.classes == FIELD
    contrast = CONTRAST * edge * 255.0
    rows = _scan(mask.T, green.T, frame.whiteness.T, COLUMN_STEP, contrast)[:, [1, 0, 2]]
    columns = _scan(mask, green, frame.whiteness, ROW_STEP, contrast)
    found = []
    for runs, axis in ((columns, 0), (rows, 1)):
        # Runs: column, row of the middle, length along the axis (0: a row, 1: a column).
        if len(runs):
            found.append(_fitting(frame, runs, axis, free, line_width))
    if not found:
        return LinePoints(np.empty((0, 2)), np.empty((0, 2)))
    pixels, places = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return LinePoints(pixels, places)


def _scan(
    mask: NDArray[np.bool_],
    green: NDArray[np.bool_],
    whiteness: Image,
    step: int,
    contrast: float,
) -> FloatArray:
    """Runs along every `step`th row: (n, 3) middle along the row, row, length [px]."""
    lines = np.arange(step // 2, len(mask), step)
    on = mask[lines]
    change = np.diff(on.astype(np.int8), axis=1)
    line, start = np.nonzero(change == 1)
    line_end, end = np.nonzero(change == -1)
    # A run at the border has only one end: keep pairs within one scan line.
    after = np.searchsorted(line_end * mask.shape[1] + end, line * mask.shape[1] + start)
    paired = after < len(end)
    line, start, after = line[paired], start[paired], after[paired]
    paired = line_end[after] == line
    line, start, end = line[paired], start[paired] + 1, end[after][paired]
    row = lines[line]
    total = np.cumsum(np.pad(green[lines], ((0, 0), (GUARD + 1, GUARD))), axis=1, dtype=np.int32)
    # total[:, i + GUARD + 1] counts up to and with pixel i.
    before = total[line, start + GUARD] - total[line, start]
    behind = total[line, end + 2 * GUARD + 1] - total[line, end + GUARD + 1]
    good = (before >= GUARD_GREEN) & (behind >= GUARD_GREEN)
    row, start, end, line = row[good], start[good], end[good], line[good]
    # Middle of the run, weighted by its whiteness, one pixel further on both sides.
    light = whiteness[lines].astype(np.float64)
    position = np.arange(mask.shape[1], dtype=np.float64)
    sum0 = np.cumsum(np.pad(light, ((0, 0), (1, 0))), axis=1)
    sum1 = np.cumsum(np.pad(light * position, ((0, 0), (1, 0))), axis=1)
    low, high = np.maximum(start - 1, 0), np.minimum(end + 1, mask.shape[1] - 1)
    base = np.minimum(light[line, low], light[line, high])
    count = high - low + 1
    weight = sum0[line, high + 1] - sum0[line, low] - base * count
    moment = sum1[line, high + 1] - sum1[line, low] - base * count * 0.5 * (low + high)
    middle = moment / np.maximum(weight, 1.0)
    sound = (middle >= low) & (middle <= high)
    middle = np.where(sound, middle, 0.5 * (start + end))
    # A net in front of green is bright too, but hardly brighter than what is beside.
    aside = np.maximum(
        light[line, np.maximum(start - GUARD, 0)],
        light[line, np.minimum(end + GUARD, mask.shape[1] - 1)],
    )
    inside = (sum0[line, end + 1] - sum0[line, start]) / (end - start + 1)
    clear = inside - aside >= contrast
    return np.stack((middle, row, end - start + 1), axis=1)[clear]


def _fitting(
    frame: Frame, runs: FloatArray, axis: int, free: NDArray[np.bool_], line_width: float
) -> tuple[FloatArray, FloatArray]:
    """Pixels and places of the runs that are as long as a line may be."""
    pixels = runs[:, :2]
    half = np.zeros_like(pixels)
    half[:, axis] = 0.5 * np.maximum(runs[:, 2] - SLACK, 0.0)
    geometry = frame.geometry
    places, meets = geometry.ground(pixels)
    ahead, good_ahead = geometry.ground(pixels + half)
    back, good_back = geometry.ground(pixels - half)
    good = meets & good_ahead & good_back
    length = np.hypot(*(ahead - back).T)
    good &= length <= WIDTH_MAX * line_width
    good &= np.hypot(*(places - geometry.camera[:2]).T) <= REACH_MAX
    row, column = np.rint(pixels[:, 1]).astype(int), np.rint(pixels[:, 0]).astype(int)
    good &= free[row, column]
    return pixels[good], places[good]
