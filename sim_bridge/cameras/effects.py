"""What motion, lens and sensor do to a rendered image; different for each camera of each robot."""

import math
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from robot_core.robot.camera import Intrinsics, RgbImage
from sim_bridge.individual import NOMINAL, stream
from sim_bridge.plant import CameraPlant

_WHITE = 255.0
_LONGEST = 32.0
"""[px] largest motion blur."""


class ImageEffects:
    """Exposure, white balance, vignette and noise of one camera.

    A pixel is clip(gain x rendered + noise), gain = exposure x white balance x vignette. The
    vignette is 1 - loss (r / R)^2 at the distance r from the principal point, R at the corner.
    """

    def __init__(
        self, plant: CameraPlant, camera: str, seed: int, noise_seed: int, intrinsics: Intrinsics
    ) -> None:
        """Draw the camera of one individual.

        Args:
            plant: How cameras differ, and their noise.
            camera: Name of the camera.
            seed: Number of the individual; -1 = nominal.
            noise_seed: Of the noise.
            intrinsics: Size and principal point of the image.
        """
        self._noise = plant.noise
        self._seed = [noise_seed, crc32(camera.encode())]
        nominal = seed == NOMINAL

        def uniform(name: str, span: tuple[float, float]) -> float:
            if nominal:
                return 0.5 * (span[0] + span[1])
            return float(stream(seed, f"camera/{camera}/{name}").uniform(*span))

        stop, tint = math.log(plant.exposure), math.log(plant.white_balance)
        exposure = math.exp(uniform("exposure", (-stop, stop)))
        balance = [math.exp(uniform(f"balance/{color}", (-tint, tint))) for color in "rb"]
        loss = uniform("vignette", plant.vignette)
        gain = exposure * np.array((balance[0], 1.0, balance[1]))
        self._gain = (gain * _vignette(intrinsics, loss)[..., None]).astype(np.float32)
        self._exact = bool(plant.noise == 0.0 and (self._gain == 1.0).all())

    def apply(
        self, image: RgbImage, stamp: int, motion: tuple[float, float] = (0.0, 0.0)
    ) -> RgbImage:
        """The image (h, w, 3) that the camera gives of a rendered one.

        Args:
            image: As rendered.
            stamp: [ns] middle of the exposure. The noise depends on it alone, not on the images
                before.
            motion: u, v [px] by which the middle of the image moves during the exposure.
        """
        image = blurred(image, motion)
        if self._exact:
            return image
        seen = image * self._gain
        if self._noise:
            rng = np.random.Generator(np.random.SFC64([*self._seed, stamp]))
            seen += np.float32(self._noise) * rng.standard_normal(seen.shape, dtype=np.float32)
        return np.clip(seen, 0.0, _WHITE, out=seen).astype(np.uint8)


def blurred(image: RgbImage, motion: tuple[float, float]) -> RgbImage:
    """The mean of an image (h, w, 3) on a straight way by `motion` [px], half before, half after.

    The whole image moves alike, as it does when the camera turns.
    """
    way = min(max(map(abs, motion)), _LONGEST)
    if way < 0.5:
        return image
    scale = way / max(map(abs, motion))
    share = np.linspace(-0.5, 0.5, math.ceil(way) + 1)
    offsets = np.rint(np.outer(share, motion) * scale).astype(int)
    reach = int(np.abs(offsets).max())
    height, width, _ = image.shape
    wide = np.pad(image, ((reach, reach), (reach, reach), (0, 0)), mode="edge")
    total = np.full(image.shape, len(offsets) // 2, dtype=np.uint16)
    for u, v in offsets.tolist():
        total += wide[reach - v : reach - v + height, reach - u : reach - u + width]
    return (total // len(offsets)).astype(np.uint8)


def _vignette(intrinsics: Intrinsics, loss: float) -> NDArray[np.float64]:
    """(h, w) share of the light that reaches each pixel."""
    u = np.arange(intrinsics.width) - intrinsics.cx
    v = np.arange(intrinsics.height) - intrinsics.cy
    square = u[None, :] ** 2 + v[:, None] ** 2
    share: NDArray[np.float64] = 1.0 - loss * square / square.max()
    return share
