"""Images of a MuJoCo world, without a window: OpenGL over EGL or OSMesa."""

import importlib
import os
from typing import Any

import mujoco
import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot.camera import CameraView, RgbImage
from sim_bridge.engines.mujoco.scene import VISIBLE
from sim_bridge.engines.opengl import OPENGL, opengl_libraries

INSTALL = (
    "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri, or libosmesa6, and pip install PyOpenGL"
)
_NEAR, _FAR = 0.02, 60.0
"""[m] distances between which things are seen; a lens in front of the head sees past it."""
_SHAPES = 20_000
"""Largest number of shapes in an image."""
_FACETS = 20, 10, 2
"""Facets of round shapes around, facets along, squares along the edge of a box."""
_BACKGROUND = [0.55, 0.6, 0.66]
"""Red, green, blue beyond the floor."""


def add_background(spec: mujoco.MjSpec) -> None:
    """What is seen beyond the floor."""
    spec.add_texture(
        name="background",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=_BACKGROUND,
        rgb2=_BACKGROUND,
        width=8,
        height=48,
    )


class MujocoPictures:
    """Renders images of one size."""

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Make an OpenGL context.

        Args:
            model: With visible shapes.
            width: Of the images [px].
            height: Of the images [px].

        Raises:
            NaoGaitError: There is no OpenGL without a window here.
        """
        self._model = model
        visual = model.vis
        # Renderers without a GPU are slow with shadows, several samples per pixel and round shapes.
        visual.quality.offsamples = visual.quality.shadowsize = 0
        visual.quality.numslices, visual.quality.numstacks, visual.quality.numquads = _FACETS
        visual.global_.offwidth, visual.global_.offheight = width, height
        self._gl = _open_context(width, height)
        self._gl.make_current()
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, maxgeom=_SHAPES)
        flags = mujoco.mjtRndFlag
        for flag in (flags.mjRND_SHADOW, flags.mjRND_REFLECTION, flags.mjRND_HAZE):
            self._scene.flags[int(flag)] = False
        self._options, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._options.geomgroup[:] = 0
        self._options.geomgroup[VISIBLE] = 1
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._size = width, height

    def fits(self, view: CameraView) -> bool:
        """Whether the images have this size."""
        return self._size == (view.intrinsics.width, view.intrinsics.height)

    def render(self, data: mujoco.MjData, view: CameraView) -> RgbImage:
        """The world as a camera in the world frame images it."""
        self._gl.make_current()
        every = int(mujoco.mjtCatBit.mjCAT_ALL)
        mujoco.mjv_updateScene(
            self._model, data, self._options, None, self._camera, every, self._scene
        )
        for eye in self._scene.camera:
            _aim(eye, view)
        width, height = self._size
        image = np.empty((height, width, 3), dtype=np.uint8)
        mujoco.mjr_render(self._rectangle, self._scene, self._context)
        mujoco.mjr_readPixels(image, None, self._rectangle, self._context)
        return np.ascontiguousarray(image[::-1])

    def close(self) -> None:
        """Free the context."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()


def _aim(eye: Any, view: CameraView) -> None:
    """Give an eye of a MuJoCo scene the pose and the frustum of a camera."""
    (position, rotation), pinhole = view.pose, view.intrinsics
    eye.pos[:], eye.forward[:], eye.up[:] = position, rotation[:, 2], -rotation[:, 1]
    eye.frustum_near, eye.frustum_far = _NEAR, _FAR
    # The image reaches half a pixel beyond the centres of its outer pixels.
    eye.frustum_top = _NEAR * (pinhole.cy + 0.5) / pinhole.fy
    eye.frustum_bottom = -_NEAR * (pinhole.height - 0.5 - pinhole.cy) / pinhole.fy
    eye.frustum_width = 0.5 * _NEAR * pinhole.width / pinhole.fx
    eye.frustum_center = _NEAR * (0.5 * (pinhole.width - 1) - pinhole.cx) / pinhole.fx


def _open_context(width: int, height: int) -> Any:
    """An OpenGL context of the library that `MUJOCO_GL` names, or of the first one installed."""
    asked = os.environ.get("MUJOCO_GL", "")
    names = [asked] if asked in OPENGL else opengl_libraries()
    try:
        if not names:
            raise ImportError("neither EGL nor OSMesa is installed")
        return importlib.import_module(f"mujoco.{names[0]}").GLContext(width, height)
    except (ImportError, AttributeError, RuntimeError, OSError) as error:
        reason = " ".join(str(error).split()).split(". ")[0]
        raise NaoGaitError("cameras", f"true, but no images: {reason}", INSTALL) from error
