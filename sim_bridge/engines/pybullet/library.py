"""The module `pybullet`, without what its C code prints."""

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator

_C_LIBRARY = ctypes.CDLL(None)  # owns the output buffers of the C code


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Discard what C code prints to the file descriptors 1 and 2, past Python."""
    sys.stdout.flush()
    sys.stderr.flush()
    with contextlib.ExitStack() as undo, open(os.devnull, "wb") as null:
        for descriptor in (1, 2):
            with contextlib.suppress(OSError):  # the descriptor may be closed
                saved = os.dup(descriptor)
                undo.callback(os.close, saved)
                undo.callback(os.dup2, saved, descriptor)
                os.dup2(null.fileno(), descriptor)
        undo.callback(_C_LIBRARY.fflush, None)
        yield


with silenced():
    import pybullet as bullet

__all__ = ["bullet", "silenced"]
