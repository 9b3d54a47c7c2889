"""The libraries with which MuJoCo renders without a window."""

import ctypes.util

OPENGL = {"egl": "EGL", "osmesa": "OSMesa"}
"""Libraries by MuJoCo's name for them."""


def opengl_libraries() -> list[str]:
    """Those that are installed, by MuJoCo's names for them."""
    return [name for name, library in OPENGL.items() if ctypes.util.find_library(library)]
