"""One run of mypyc, in a process of its own: `extension.py LIBRARY TEMPORARY LEVEL MODULE...`

Runs in the folder that holds the package of the modules, which are paths relative to it.
"""

import os
import sys

from mypyc.build import mypycify
from mypyc.ir.ops import ERR_NEVER
from mypyc.ir.rtypes import float_rprimitive
from mypyc.primitives.registry import function_op
from setuptools import setup

MYPY = ("--config-file=", "--ignore-missing-imports", "--check-untyped-defs")
# Compilers for machines with a fused multiply-add use it where they may, and round differently.
SAME_BITS = "-ffp-contract=off"


# Of the functions of math mypyc knows sin, cos, sqrt and the like, and calls the others as Python
# does. These three are C's own too; what they are given is finite and inside their domain.
ALSO_OF_C = {"acos": 1, "asin": 1, "atan2": 2}


def know_more_of_math() -> None:
    """Register what mypyc then calls without a detour."""
    for name, count in ALSO_OF_C.items():
        function_op(
            name=f"math.{name}",
            arg_types=[float_rprimitive] * count,
            return_type=float_rprimitive,
            c_function_name=name,
            error_kind=ERR_NEVER,
        )


def main(library: str, temporary: str, level: str, *modules: str) -> None:
    """Machine code of the modules into `library`, by way of `temporary`; level: of optimisation."""
    know_more_of_math()
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
