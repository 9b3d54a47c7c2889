"""One image, prepared once for all detectors."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from nao_soccer.vision.colors import FIELD, ColorClassifier, Image
from nao_soccer.vision.image_geometry import ImageGeometry
from robot_core.types import FloatArray

COLUMN_STEP = 8
"""Columns between two points of the field boundary."""
RUN = 5
"""Rows of a column that are looked at together for the field boundary."""
RUN_GREEN = 4
"""Least number of green rows among them."""
STEEP = 0.5
"""Slope of the boundary's first or last piece from which on it is a post at the image's edge."""
STEEP_WIDTH = 0.15
"""Greatest width of such a piece, of the image's."""
HORIZON_SLACK = 6
"""Rows by which the field may seem to rise over the horizon, for errors of the camera's pose."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """An image with what all detectors need of it.

    Attributes:
        image: (height, width, 3) balanced image.
        classes: (height, width) colour class of each pixel.
        whiteness: (height, width) the smaller of red and blue: about equal for all grounds but
            white, whatever part of a pixel a line covers.
        geometry: Camera at the time of the image.
        horizon: (width,) rows of the horizon.
        boundary: (m, 2) columns and rows of the upper edge of the field; m is 0 without a field.
        boundary_row: (width,) the same for each column; the height of the image without a field.
    """

    image: Image
    classes: Image
    whiteness: Image
    geometry: ImageGeometry
    horizon: FloatArray
    boundary: FloatArray
    boundary_row: NDArray[np.intp]

    def inside(self, pixels: FloatArray) -> NDArray[np.bool_]:
        """Which pixels (n, 2) lie in the image; false for NaN."""
        return self.geometry.view.intrinsics.contains(pixels)

    def on_field(self, pixels: FloatArray) -> NDArray[np.bool_]:
        """Which pixels (n, 2) in the image lie below the upper edge of the field."""
        columns = np.clip(np.rint(pixels[:, 0]).astype(int), 0, len(self.boundary_row) - 1)
        return np.asarray(pixels[:, 1] >= self.boundary_row[columns])


def make_frame(image: Image, geometry: ImageGeometry, classifier: ColorClassifier) -> Frame:
    """Balance and classify an image (height, width, 3), and find the upper edge of the field."""
    height, width = image.shape[:2]
    horizon = geometry.horizon(np.arange(width, dtype=float))
    classifier.adapt(image, int(np.clip(horizon.min(), 0, height)))
    balanced = classifier.balance(image)
    classes = classifier.classify(balanced, image)
    red, _, blue = cv2.split(balanced)
    whiteness = np.asarray(cv2.min(red, blue))
    boundary = _boundary(classes, horizon)
    rows = np.full(width, height, dtype=np.intp)
    if len(boundary):
        line = np.interp(np.arange(width), boundary[:, 0], boundary[:, 1])
        rows = np.clip(np.ceil(line), 0, height).astype(np.intp)
    return Frame(balanced, classes, whiteness, geometry, horizon, boundary, rows)


def _boundary(classes: Image, horizon: FloatArray) -> FloatArray:
    """Upper edge of the field: the hull of the topmost green of some columns.

    A field is convex, and so is its image; robots and goals only hide parts of its edge.
    """
    height, width = classes.shape
    columns = np.arange(COLUMN_STEP // 2, width, COLUMN_STEP)
    green = classes[:, columns] == FIELD
    # Green rows among the RUN rows from each row down.
    total = np.cumsum(np.vstack((np.zeros((1, len(columns)), dtype=int), green)), axis=0)
    dense = green[: height - RUN + 1] & (total[RUN:] - total[:-RUN] >= RUN_GREEN)
    rows = np.arange(dense.shape[0])[:, None]
    dense &= rows >= horizon[columns] - HORIZON_SLACK
    seen = dense.any(axis=0)
    if seen.sum() < 3:
        return np.empty((0, 2))
    points = np.stack((columns[seen], dense.argmax(axis=0)[seen]), axis=1).astype(float)
    hull: list[FloatArray] = []
    for point in points:
        # Rows grow downwards: the upper hull turns clockwise on the screen.
        while len(hull) > 1 and _cross(hull[-2], hull[-1], point) <= 0.0:
            hull.pop()
        hull.append(point)
    line = np.array(hull)
    for end in (line, line[::-1]):
        _flatten(end, STEEP_WIDTH * width)
    return line


def _flatten(line: FloatArray, reach: float) -> None:
    """Continue a boundary (m, 2) over its steep first piece, where a post hides it; in place."""
    if len(line) < 3:
        return
    end, first, second = line[:3]
    run, rise = first - end
    if abs(run) < reach and abs(rise) > STEEP * abs(run):
        along, across = second - first
        end[1] = first[1] - across / along * run


def _cross(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Positive if a, b, c turn to the right on the screen: b lies above the line from a to c."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
