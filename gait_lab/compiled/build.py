"""Writes a folder with the compiled gait. First on PYTHONPATH, it replaces the source.

build/compiled/nao_lipm_gait/      the gait; each module of the tick beside its machine code
build/compiled/robot_core/         what it stands on, likewise
build/compiled/config, urdf, ...   links to the shared files, which the packages look up there
"""

import contextlib
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from robot_core.errors import NaoGaitError
from robot_core.resources import share
from sim_bridge.trials.compiled import MADE_OF, PACKAGES, SOURCE, sources

FOLDERS = ("estimation", "walks", "whole_body")
AS_PYTHON = (
    "calibration.py", "calibration_file.py", "gym.py", "parameters.py", "presets.py",
    "walk_engines.py",
)
"""Modules of the gait's root that stay Python: off the tick, pickled, or made by attrs."""
OF_CORE = ("geometry.py", "joint_limits.py", "rate_limiter.py", "types.py")
SHARED = ("config", "examples", "launch", "package.xml", "urdf")
LINES_SHOWN = 15
NUMBER = re.compile(r"^([A-Z][A-Z_]*) = (-?[\d.]+(?:e-?\d+)?)$", re.MULTILINE)
"""A constant of a module on a line of its own."""


def compile_gait(folder: Path, say: Callable[[str], None], *, optimise: bool = True) -> None:
    """Compile the gait into a folder, unless it is there already.

    Args:
        folder: A new or empty folder, or that of an earlier run, which is replaced.
        say: Shows a line of progress.
        optimise: False compiles faster and gives a slower gait.

    Raises:
        NaoGaitError: The folder is in use, or the compilation fails; it shows what mypyc says.
    """
    folder = folder.resolve()
    made_of = f"{sources(SOURCE)} {_compiler()} {optimise}\n"
    if folder.is_dir() and any(folder.iterdir()):
        if not (folder / MADE_OF).is_file():
            raise NaoGaitError(
                "folder", str(folder), "a new or empty folder, or one that `nao_gait compile` wrote"
            )
        if (folder / MADE_OF).read_text(encoding="utf-8") == made_of:
            return
        shutil.rmtree(folder)
    elif folder.exists() and not folder.is_dir():
        raise NaoGaitError("folder", str(folder), "a folder, not a file")
    modules = sorted(path.relative_to(SOURCE) for path in _modules_of_the_tick())
    say(f"compiling {len(modules)} modules of the gait (2 to 4 minutes) ...")
    with tempfile.TemporaryDirectory(prefix="nao_gait_") as temporary:
        library, objects = Path(temporary, "library"), Path(temporary, "objects")
        for package in PACKAGES:
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(SOURCE / package, library / package, ignore=ignored)
        for module in modules:
            _make_numbers_final(library / module)
        _run_mypyc(library, objects, "3" if optimise else "0", modules)
        for name in SHARED:
            (library / name).symlink_to(share(name).resolve())
        (library / MADE_OF).write_text(made_of, encoding="utf-8")
        folder.parent.mkdir(parents=True, exist_ok=True)
        _put(library, folder)
    say(f"to use this gait, set PYTHONPATH={folder}${{PYTHONPATH:+:$PYTHONPATH}}")


def _make_numbers_final(module: Path) -> None:
    """Declare a module's numbers `Final`, here and not in the source, which stays readable.

    Machine code then holds them, instead of looking them up in each tick.
    """
    source = module.read_text(encoding="utf-8")
    final = NUMBER.sub(r"import typing; \1: typing.Final = \2", source)
    module.write_text(final, encoding="utf-8")


def _put(library: Path, folder: Path) -> None:
    """Move the library to its place in one step, where another process may put the same one."""
    beside = folder.with_name(f"{folder.name}.{os.getpid()}")
    shutil.move(library, beside)  # from another file system this copies
    with contextlib.suppress(OSError):
        folder.rmdir()  # empty
    try:
        beside.rename(folder)
    except OSError as error:
        shutil.rmtree(beside)
        if not (folder / MADE_OF).is_file():
            raise NaoGaitError("folder", str(folder), "a folder that nobody else fills") from error


def _compiler() -> str:
    """What the machine code depends on besides the source."""
    try:
        from mypy.version import __version__ as mypy
    except ModuleNotFoundError:
        mypy = "none"  # the compilation will report it
    code = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return f"{hashlib.sha256(code).hexdigest()} {mypy} {platform.python_version()}"


def _modules_of_the_tick() -> Iterator[Path]:
    yield from (SOURCE / "robot_core" / name for name in OF_CORE)
    gait = SOURCE / "nao_lipm_gait"
    for path in gait.rglob("*.py"):
        if path.name == "__init__.py" or path.name in AS_PYTHON:
            continue
        if path.parent == gait or path.relative_to(gait).parts[0] in FOLDERS:
            yield path


def _run_mypyc(library: Path, objects: Path, level: str, modules: list[Path]) -> None:
    """Compile modules of the package in `library`, beside their source."""
    arguments = (Path(__file__).with_name("extension.py"), library, objects, level, *modules)
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=library, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    if done.returncode != 0:
        output = "\n".join(done.stdout.strip().splitlines()[-LINES_SHOWN:])
        raise NaoGaitError(
            "compilation", f"failed:\n{output}\n", "mypy, a C compiler and the headers of Python"
        )
