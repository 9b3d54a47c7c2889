"""A folder with the gait compiled; first on PYTHONPATH it takes the place of the source.

build/compiled/nao_lipm_gait/      the package, each module of the tick beside its machine code
build/compiled/config, urdf, ...   links to the shared files, which the package looks for there
"""

import hashlib
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from gait_lab.compiled import MADE_OF, SOURCE, sources
from gait_lab.compiled.records import spelled_out
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.resources import share

FOLDERS = ("estimation", "walks", "whole_body")
AS_THEY_ARE = (
    "errors.py", "parameters.py", "presets.py", "resources.py", "schema.py",
)  # fmt: skip
"""Of the package's own modules: what is pickled, caught or taken apart as a dataclass."""
SHARED = ("config", "launch", "urdf")
LINES_SHOWN = 15


def compile_gait(folder: Path, say: Callable[[str], None], *, optimise: bool = True) -> None:
    """Compile the gait into `folder`, unless it is there; without `optimise` it is sooner ready.

    NaoGaitError, with what the compiler says, where it cannot be compiled; an earlier gait in the
    folder, which is of other sources, is then gone.
    """
    folder = folder.resolve()
    made_of = f"{sources(SOURCE)} {_compiler()} {optimise}\n"
    if folder.is_dir() and any(folder.iterdir()):
        if not (folder / MADE_OF).is_file():
            raise NaoGaitError("folder", str(folder), "one that is new, empty or of an earlier run")
        if (folder / MADE_OF).read_text(encoding="utf-8") == made_of:
            return
        shutil.rmtree(folder)
    elif folder.exists() and not folder.is_dir():
        raise NaoGaitError("folder", str(folder), "no file")
    modules = sorted(path.relative_to(SOURCE.parent) for path in _of_the_tick())
    say(f"compiling {len(modules)} modules of the gait (about a minute) ...")
    with tempfile.TemporaryDirectory(prefix="nao_gait_") as temporary:
        source, library = Path(temporary, "source"), Path(temporary, "library")
        for path in SOURCE.rglob("*.py"):
            module, text = path.relative_to(SOURCE.parent), path.read_text(encoding="utf-8")
            _write(library / module, text)
            _write(source / module, spelled_out(text, str(module)) if module in modules else text)
        _run_mypyc(source, library, Path(temporary, "objects"), "3" if optimise else "0", modules)
        for name in SHARED:
            (library / name).symlink_to(share(name).resolve())
        _write(library / MADE_OF, made_of)
        if folder.exists():
            folder.rmdir()
        folder.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(library, folder)
    first = f"{folder}${{PYTHONPATH:+:$PYTHONPATH}}"
    say(f"before a command, PYTHONPATH={first} makes it walk with this gait")


def _compiler() -> str:
    """What else than the source the machine code depends on."""
    try:
        from mypy.version import __version__ as mypy
    except ModuleNotFoundError:
        mypy = "none"  # which the compilation will say
    code = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return f"{hashlib.sha256(code).hexdigest()} {mypy} {platform.python_version()}"


def _of_the_tick() -> Iterator[Path]:
    """The modules that a tick runs through."""
    for path in SOURCE.rglob("*.py"):
        if path.name == "__init__.py" or path.name in AS_THEY_ARE:
            continue
        if path.parent == SOURCE or path.relative_to(SOURCE).parts[0] in FOLDERS:
            yield path


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _run_mypyc(
    source: Path, library: Path, objects: Path, level: str, modules: list[Path]
) -> None:
    arguments = (Path(__file__).with_name("extension.py"), library, objects, level, *modules)
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=source, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    if done.returncode != 0:
        said = "\n".join(done.stdout.strip().splitlines()[-LINES_SHOWN:])
        raise NaoGaitError(
            "compilation", f"failed:\n{said}\n", "mypy, a C compiler and the headers of Python"
        )
