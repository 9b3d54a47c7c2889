"""Runs mypyc once, in its own process: `extension.py LIBRARY TEMPORARY LEVEL MODULE...`.

It runs in the folder that holds the package; the modules are paths relative to it.
"""

import os
import sys

from mypyc.build import mypycify
from setuptools import setup

MYPY = ("--config-file=", "--ignore-missing-imports", "--check-untyped-defs")
# With a fused multiply-add a compiler would round differently.
SAME_BITS = "-ffp-contract=off"


def main(library: str, temporary: str, level: str, *modules: str) -> None:
    """Compile modules to machine code.

    Args:
        library: Folder for the result.
        temporary: Folder for object files.
        level: Optimisation level of the C compiler, 0 to 3.
        *modules: Paths of the modules.
    """
    extensions = mypycify([*MYPY, *modules], opt_level=level, debug_level="0")
    for extension in extensions:
        extension.extra_compile_args.append(SAME_BITS)
    setup(
        name="nao_lipm_gait_compiled",
        ext_modules=extensions,
        script_args=[
            *("--quiet", "build_ext", "--parallel", str(os.cpu_count() or 1)),
            *("--build-lib", library, "--build-temp", temporary),
        ],
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
