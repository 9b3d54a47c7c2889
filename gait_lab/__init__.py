"""Offline tools on the gait and its simulated robot: rollouts, benchmarks, demo, figures."""

import os
from contextlib import suppress
from pathlib import Path

# OpenBLAS chooses its kernels by the processor. They differ in the last bits, and these decide how
# a match goes. NumPy reads this when it is imported.
with suppress(OSError):
    if " avx2 " in Path("/proc/cpuinfo").read_text(encoding="utf-8"):
        os.environ.setdefault("OPENBLAS_CORETYPE", "Haswell")
