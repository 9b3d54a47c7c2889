"""The image with what was found drawn into it."""

import cv2
import numpy as np

from nao_soccer.vision.colors import Image
from nao_soccer.vision.frame import Frame
from nao_soccer.vision.percepts import CROSSINGS, Kind, Percepts

_COLORS = {
    Kind.BALL: (255, 0, 255),
    Kind.GOAL_POST: (255, 255, 0),
    Kind.POLE: (0, 255, 255),
    Kind.ROBOT_RED: (255, 60, 60),
    Kind.ROBOT_BLUE: (80, 120, 255),
}
_LINE, _BOUNDARY, _CROSSING = (255, 0, 0), (255, 160, 0), (0, 0, 255)
_TEXT = 0.35
"""Height of the font, of OpenCV's."""
_SCALE = 2
"""Enlargement of the image."""


def draw_debug_image(frame: Frame, percepts: Percepts, image: Image | None = None) -> Image:
    """The image (2 height, 2 width, 3), red, green, blue, with all percepts.

    `image` is what is drawn on; None = the balanced image of the frame.
    """
    picture = frame.image if image is None else image
    picture = cv2.resize(picture, None, fx=_SCALE, fy=_SCALE, interpolation=cv2.INTER_NEAREST)
    geometry = frame.geometry

    def at(pixel: np.ndarray) -> tuple[int, int]:
        u, v = np.clip((pixel + 0.5) * _SCALE, -9999, 9999)
        return int(u), int(v)

    def label(text: str, pixel: np.ndarray, color: tuple[int, int, int]) -> None:
        cv2.putText(
            picture, text, at(pixel), cv2.FONT_HERSHEY_SIMPLEX, _TEXT, color, 1, cv2.LINE_AA
        )

    if len(percepts.boundary):
        line = np.array([at(point) for point in percepts.boundary])
        cv2.polylines(picture, [line], False, _BOUNDARY, 1, cv2.LINE_AA)
    for segment in percepts.segments:
        for pixel in segment.pixels:
            cv2.circle(picture, at(pixel), 1, (0, 200, 255), -1)
        ends = geometry.pixels_of(np.array((segment.start, segment.end)))
        if np.isfinite(ends).all():
            cv2.line(picture, at(ends[0]), at(ends[1]), _LINE, 1, cv2.LINE_AA)
    found = percepts.objects if percepts.ball is None else (percepts.ball, *percepts.objects)
    for each in found:
        x, y = each.position
        text = f"{np.hypot(x, y):.2f} m"
        spot = geometry.pixels_of(np.array([each.position]))[0]
        if each.kind in CROSSINGS and np.isfinite(spot).all():
            cv2.circle(picture, at(spot), 5, _CROSSING, 2, cv2.LINE_AA)
            label(each.kind.value[-1].upper(), spot + (4, -4), _CROSSING)
        elif each.kind is Kind.CENTRE_CIRCLE and np.isfinite(spot).all():
            cv2.drawMarker(picture, at(spot), _CROSSING, cv2.MARKER_CROSS, 16, 2)
            label("circle", spot + (4, -4), _CROSSING)
        elif each.box is not None:
            color = _COLORS[each.kind]
            corners = np.array(((each.box.left, each.box.top), (each.box.right, each.box.bottom)))
            if each.kind is Kind.BALL:
                radius = int(0.5 * (each.box.right - each.box.left) * _SCALE)
                cv2.circle(picture, at(corners.mean(axis=0)), radius + 2, color, 2, cv2.LINE_AA)
            else:
                cv2.rectangle(picture, at(corners[0]), at(corners[1]), color, 1)
            name = each.kind.value.replace("_", " ")
            label(f"{name} {text}", corners[0] - (0, 3), color)
    return np.asarray(picture, dtype=np.uint8)
