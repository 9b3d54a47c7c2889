"""What the outline of a sole has to be."""

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.types import Point2


def check_outline(where: str, outline: tuple[Point2, ...]) -> None:
    """where: the key and its file, for the error."""
    if len(outline) < 3:
        raise NaoGaitError(where, f"{len(outline)} points", "at least 3 points")
    for index, (x1, y1) in enumerate(outline):
        x0, y0 = outline[index - 1]
        x2, y2 = outline[(index + 1) % len(outline)]
        if (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1) <= 0.0:
            raise NaoGaitError(where, (x1, y1), "points of a convex outline, counter-clockwise")


def check_corners(where: str, corners: tuple[Point2, ...], outline: tuple[Point2, ...]) -> None:
    if len(corners) != 4 or not set(corners) <= set(outline):
        raise NaoGaitError(where, corners, "four points of sole_outline")
