"""Images of a MuJoCo world, without a window: OpenGL over EGL or OSMesa."""

import importlib
import os
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from robot_core.errors import NaoGaitError
from robot_core.robot.camera import CameraView, RgbImage
from sim_bridge.engines.mujoco.scene import VISIBLE
from sim_bridge.engines.opengl import OPENGL, opengl_libraries

INSTALL = (
    "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri, or libosmesa6, and pip install PyOpenGL"
)
_NEAR, _FAR = 0.02, 60.0
"""[m] distances between which things are seen; a lens in front of the head sees past it."""
_SLACK = 0.01
"""[m] by which a shape may be outside of an image and is still drawn."""
_OUT_OF_VIEW = 5
"""Group of shapes that are not drawn in the present image."""
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
        self._visible = np.flatnonzero(model.geom_group == VISIBLE)
        self._reach = model.geom_rbound[self._visible] + _SLACK
        self._reach[model.geom_rbound[self._visible] == 0.0] = np.inf  # a plane

    def fits(self, view: CameraView) -> bool:
        """Whether the images have this size."""
        return self._size == (view.intrinsics.width, view.intrinsics.height)

    def render(self, data: mujoco.MjData, view: CameraView) -> RgbImage:
        """The world as a camera in the world frame images it."""
        self._gl.make_current()
        every = int(mujoco.mjtCatBit.mjCAT_ALL)
        shown = self._in_view(data, view)
        self._model.geom_group[self._visible[~shown]] = _OUT_OF_VIEW
        mujoco.mjv_updateScene(
            self._model, data, self._options, None, self._camera, every, self._scene
        )
        self._model.geom_group[self._visible] = VISIBLE
        for eye in self._scene.camera:
            _aim(eye, view)
        width, height = self._size
        image = np.empty((height, width, 3), dtype=np.uint8)
        mujoco.mjr_render(self._rectangle, self._scene, self._context)
        mujoco.mjr_readPixels(image, None, self._rectangle, self._context)
        return np.ascontiguousarray(image[::-1])

    def _in_view(self, data: mujoco.MjData, view: CameraView) -> NDArray[np.bool_]:
        """(n,) which visible shapes may be in an image; the others cost as much to draw."""
        (position, rotation), pinhole = view.pose, view.intrinsics
        place = (data.geom_xpos[self._visible] - position) @ rotation
        # Inward normals of the planes through the camera and the edges of the image, and ahead.
        left, top = (pinhole.cx + 0.5) / pinhole.fx, (pinhole.cy + 0.5) / pinhole.fy
        right = (pinhole.width - 0.5 - pinhole.cx) / pinhole.fx
        bottom = (pinhole.height - 0.5 - pinhole.cy) / pinhole.fy
        planes = np.array(
            ((1.0, 0.0, left), (-1.0, 0.0, right), (0.0, 1.0, top), (0.0, -1.0, bottom), (0, 0, 1))
        )
        planes /= np.linalg.norm(planes, axis=1)[:, None]
        result: NDArray[np.bool_] = (place @ planes.T > -self._reach[:, None]).all(axis=1)
        return result

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
