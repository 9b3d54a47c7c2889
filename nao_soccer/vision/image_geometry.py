"""From pixels to places on the ground, with the errors of pixel and camera pose."""

from dataclasses import dataclass
from typing import NamedTuple

import attrs
import numpy as np
from numpy.typing import NDArray

from robot_core.robot.camera import CameraPose, CameraView
from robot_core.schema import Settings, number
from robot_core.types import FloatArray, Point2

MIN_SLOPE = 0.02
"""Smallest downward component of a unit ray that meets the ground. Flatter ones end 50 camera
heights away, where a place means nothing."""


OUTLIER = 4.0
"""Two measurements that differ by more standard deviations contradict each other."""


@attrs.frozen
class PoseError(Settings):
    """Standard deviations of a camera's pose in base_footprint, and of an edge in its image."""

    mounting: float = number(
        0.02,
        0.0,
        0.2,
        "rad",
        "Lasting tilt of a robot about a horizontal axis, until it is learned.",
    )
    tilt: float = number(0.008, 1e-4, 0.2, "rad", "Tilt about a horizontal axis in one image.")
    pan: float = number(0.015, 1e-4, 0.2, "rad", "About the vertical axis.")
    height: float = number(0.005, 1e-4, 0.1, "m", "Height of the camera.")
    pixel: float = number(0.5, 0.05, 10.0, "px", "An edge in the image.")


class Tilt(NamedTuple):
    """What an object of known size says of the tilt of the camera.

    Attributes:
        angle: [rad] by which the camera looks lower than its pose says.
        variance: [rad^2]
        bearing: [rad] of the object in base_footprint.
    """

    angle: float
    variance: float
    bearing: float


class Place(NamedTuple):
    """A place on the ground by two measurements.

    Attributes:
        position: [m] in base_footprint.
        covariance: Variance of x, covariance of x and y, variance of y [m^2].
        distance: [m] from the foot of the camera.
        tilt: What the difference of the two says of the camera; None without a difference.
    """

    position: Point2
    covariance: tuple[float, float, float]
    distance: float
    tilt: Tilt | None


def bearing_of(view: CameraView) -> float:
    """[rad] of a camera's line of sight in base_footprint."""
    rotation = view.pose.rotation
    return float(np.arctan2(rotation[1, 2], rotation[0, 2]))


def lowered(view: CameraView, angle: float) -> CameraView:
    """A camera whose line of sight is lower by an angle [rad]."""
    bearing = bearing_of(view)
    # Rodrigues, about the horizontal axis to the left of the line of sight.
    x, y = -np.sin(bearing), np.cos(bearing)
    skew = np.array(((0.0, 0.0, y), (0.0, 0.0, -x), (-y, x, 0.0)))
    turn = np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
    return CameraView(view.intrinsics, CameraPose(view.pose.position, turn @ view.pose.rotation))


@dataclass(frozen=True, slots=True, eq=False)
class ImageGeometry:
    """A camera at the time of its image.

    Attributes:
        view: Intrinsics, and pose of the optical frame in base_footprint.
        error: Standard deviations.
    """

    view: CameraView
    error: PoseError = PoseError()

    @property
    def width(self) -> int:
        """Columns [px]."""
        return self.view.intrinsics.width

    @property
    def height(self) -> int:
        """Rows [px]."""
        return self.view.intrinsics.height

    @property
    def focal(self) -> float:
        """Focal length [px]."""
        return self.view.intrinsics.fx

    @property
    def camera(self) -> FloatArray:
        """(3,) [m] Position of the camera in base_footprint."""
        return self.view.pose.position

    def lowered(self, angle: float) -> "ImageGeometry":
        """The same with the line of sight lower by an angle [rad]."""
        return ImageGeometry(lowered(self.view, angle), self.error)

    def rays(self, pixels: FloatArray) -> FloatArray:
        """Unit rays (n, 3) in base_footprint through pixels (n, 2)."""
        rays = self.view.rays(pixels)
        rays /= np.sqrt(np.einsum("ij,ij->i", rays, rays))[:, None]
        return rays

    def ground(
        self, pixels: FloatArray, height: float = 0.0
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Where rays through pixels (n, 2) meet a horizontal plane at a height [m].

        Places (n, 2) [m] in base_footprint, and whether each ray meets the plane (n,).
        """
        ray = self.rays(pixels)
        down = -ray[:, 2]
        meets = down > MIN_SLOPE
        scale = (self.camera[2] - height) / np.where(meets, down, 1.0)
        return self.camera[:2] + scale[:, None] * ray[:, :2], meets

    def pixels_of(self, places: FloatArray, height: float = 0.0) -> FloatArray:
        """Pixels (n, 2) of places (n, 2) [m] on a horizontal plane; NaN behind the camera."""
        return self.view.project(np.column_stack((places, np.full(len(places), height))))

    def covariance(self, places: FloatArray, height: float = 0.0) -> FloatArray:
        """Covariances (n, 3) [m^2] of places (n, 2) [m] on a plane, by errors of pixel and pose.

        A ray that falls by `drop` over the slant range s has its place at the distance r. An angle
        changes r by s^2 / drop, a pixel across it by s, the height of the camera by r / drop.
        """
        offset = places - self.camera[:2]
        drop = max(float(self.camera[2]) - height, 1e-3)
        reach = np.hypot(offset[:, 0], offset[:, 1])
        x, y = (offset / np.maximum(reach, 1e-9)[:, None]).T
        slant2 = reach**2 + drop**2
        error = self.error
        pixel2 = (error.pixel / self.focal) ** 2
        along = (slant2 / drop) ** 2 * (error.tilt**2 + pixel2)
        along += (reach / drop * error.height) ** 2
        across = (reach * error.pan) ** 2 + (drop * error.tilt) ** 2 + slant2 * pixel2
        result = np.empty((len(places), 3))
        result[:, 0] = along * x * x + across * y * y
        result[:, 1] = (along - across) * x * y
        result[:, 2] = along * y * y + across * x * x
        return result

    def place(
        self,
        unit: FloatArray,
        drop: float,
        by_height: float | None,
        by_size: float,
        size_variance: float,
    ) -> Place | None:
        """The place of an object by its direction, its height in the image and its size.

        The two distances are averaged by their variances; None if they contradict each other.

        Args:
            unit: (2,) direction from the foot of the camera.
            drop: [m] of the line of sight from the camera to the object.
            by_height: [m] Distance by the height in the image; None at the horizon.
            by_size: [m] Distance by the size in the image.
            size_variance: [m^2] of the latter.
        """
        error = self.error
        pixel2 = (error.pixel / self.focal) ** 2
        tilt = None
        distance, variance = by_size, size_variance
        if by_height is not None:
            # An angle changes the distance by slant^2 / drop.
            lever = (by_size**2 + drop**2) / drop
            noise = lever**2 * pixel2 + (by_size / drop * error.height) ** 2
            height_variance = lever**2 * error.tilt**2 + noise
            apart = by_height - by_size
            if abs(apart) > OUTLIER * np.sqrt(height_variance + size_variance):
                return None
            share = size_variance / (size_variance + height_variance)
            distance, variance = by_size + share * apart, (1.0 - share) * size_variance
            bearing = float(np.arctan2(unit[1], unit[0]))
            tilt = Tilt(apart / lever, (noise + size_variance) / lever**2, bearing)
        elif by_size < drop / MIN_SLOPE / OUTLIER:
            return None
        across = (distance * error.pan) ** 2 + (drop * error.tilt) ** 2
        across += (distance**2 + drop**2) * pixel2
        x, y = unit.tolist()
        covariance = (
            variance * x * x + across * y * y,
            (variance - across) * x * y,
            variance * y * y + across * x * x,
        )
        spot = self.camera[:2] + distance * unit
        return Place((float(spot[0]), float(spot[1])), covariance, float(distance), tilt)

    def horizon(self, columns: FloatArray) -> FloatArray:
        """Rows (n,) [px] of the horizon in columns (n,); they may be outside the image."""
        pinhole = self.view.intrinsics
        # The ray through (u, v) is level where a (u - cx) / fx + b (v - cy) / fy + c = 0.
        a, b, c = self.view.pose.rotation[2]
        b = b if abs(b) > 1e-6 else -1e-6
        return pinhole.cy - pinhole.fy * (a * (columns - pinhole.cx) / pinhole.fx + c) / b
