"""Shipped files are found in every kind of installation, and a missing file is reported clearly."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from robot_core import resources
from robot_core.errors import NaoGaitError


@pytest.mark.parametrize(
    ("kind", "name", "path"),
    [
        ("urdf", "nao_h21_v33", "urdf/nao_h21_v33.urdf"),
        ("urdf", "nao_h21_v40", "urdf/nao_h21_v40.urdf"),
        ("plants", "reference", "config/plants/reference.yaml"),
        ("gait", "paper", "config/gait/paper.yaml"),
        ("robots", "nao_h21", "config/robots/nao_h21.yaml"),
    ],
)
def test_shipped_names(kind: str, name: str, path: str) -> None:
    assert resources.find(kind, name) == resources.share() / path
    assert resources.find(kind, name).is_file()
    assert name in resources.names(kind)


def test_names_are_those_of_the_files() -> None:
    assert {"bruno", "default", "ideal", "paper", "preview", "zmp"} <= set(resources.names("gait"))
    assert {"ideal", "reference", "worn"} <= set(resources.names("plants"))
    assert {"bruno", "nao_h21_v33", "nao_h21_v40"} <= set(resources.names("urdf"))


def test_share_finds_files_and_folders() -> None:
    assert resources.share("launch", "walk.launch.py").is_file()
    assert resources.share("urdf").is_dir()
    with pytest.raises(NaoGaitError, match=r"launch/run\.launch\.py.*installed"):
        resources.share("launch", "run.launch.py")


@pytest.mark.parametrize(
    ("kind", "field"),
    [("urdf", "robot"), ("plants", "plant"), ("gait", "preset"), ("robots", "robot")],
)
def test_an_unknown_name_lists_what_there_is(kind: str, field: str) -> None:
    with pytest.raises(NaoGaitError) as refused:
        resources.find(kind, "nobody")
    assert str(refused.value).startswith(f"{field}: got 'nobody'; allowed: ")
    for name in resources.names(kind):
        assert name in refused.value.allowed


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(NaoGaitError, match="urdf, plants, gait, robots"):
        resources.find("meshes", "nao")


def test_a_path_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text("x: 1\n")
    assert resources.find("plants", str(mine)) == mine
    assert resources.find("plants", mine) == mine
    monkeypatch.chdir(tmp_path)
    assert resources.find("plants", "mine.yaml").samefile(mine)
    assert resources.find("plants", "./mine.yaml").samefile(mine)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert resources.find("plants", "~/mine.yaml").samefile(mine)


def test_a_shipped_name_wins_over_a_file_beside_me(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "reference").write_text("")
    monkeypatch.chdir(tmp_path)
    assert resources.find("plants", "reference") == resources.share("config/plants/reference.yaml")
    assert resources.find("plants", "./reference").samefile(tmp_path / "reference")


@pytest.mark.parametrize(
    "path", ["/no/such.yaml", "no_such.yaml", "a/b", "", "nul\0byte", "~nobody_here/x", "x" * 5000]
)
def test_a_path_that_is_none_is_refused(path: str) -> None:
    with pytest.raises(NaoGaitError, match="ideal, reference"):
        resources.find("plants", path)


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="a file that exists"):
        resources.find("plants", tmp_path)


class Installation:
    """A made-up installation that holds the shipped files and a copy of the module."""

    def __init__(self, package: Path, shared: Path | None) -> None:
        package.mkdir(parents=True)
        shutil.copy(resources.__file__, package / "resources.py")
        self.package = package
        if shared is not None:
            fill(shared)

    def load(self) -> ModuleType:
        """The module as it would be imported from there."""
        spec = importlib.util.spec_from_file_location("installed", self.package / "resources.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module


def fill(shared: Path) -> None:
    (shared / "config" / "gait").mkdir(parents=True)
    (shared / "config" / "gait" / "default.yaml").write_text("")


@pytest.fixture(autouse=True)
def _nothing_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """This package may be installed in the environment of the tests; found there proves nothing."""
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "no_prefix"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "no_ament"))


SITE = "lib/python3.12/site-packages/nao_lipm_gait"


@pytest.mark.parametrize(
    ("package", "shared"),
    [
        pytest.param("src/nao_lipm_gait", "src", id="checkout"),
        pytest.param(f"venv/{SITE}", "venv/share/nao_lipm_gait", id="wheel"),
        pytest.param(f"ws/install/nao_lipm_gait/{SITE}",
                     "ws/install/nao_lipm_gait/share/nao_lipm_gait", id="colcon"),
        pytest.param(f"ws/install/{SITE}", "ws/install/share/nao_lipm_gait", id="merged"),
        pytest.param("usr/local/lib/python3.12/dist-packages/nao_lipm_gait",
                     "usr/local/share/nao_lipm_gait", id="debian"),
    ],
)  # fmt: skip
def test_found_in_every_installation(tmp_path: Path, package: str, shared: str) -> None:
    module = Installation(tmp_path / package, tmp_path / shared).load()
    assert module.share("config", "gait") == tmp_path / shared / "config" / "gait"
    assert module.names("gait") == ("default",)


def test_found_behind_a_link(tmp_path: Path) -> None:
    """Colcon build --symlink-install."""
    Installation(tmp_path / "src" / "nao_lipm_gait", tmp_path / "src")
    built = tmp_path / "build" / "nao_lipm_gait"
    built.mkdir(parents=True)
    (built / "nao_lipm_gait").symlink_to(tmp_path / "src" / "nao_lipm_gait")
    spec = importlib.util.spec_from_file_location(
        "linked", built / "nao_lipm_gait" / "resources.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.share() == tmp_path / "src"


def test_found_by_the_prefix_of_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Packages and data may lie apart: `sys.prefix` and what ament knows are the last resorts."""
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "prefix"))
    fill(tmp_path / "prefix" / "share" / "nao_lipm_gait")
    module = Installation(tmp_path / "elsewhere" / "nao_lipm_gait", None).load()
    assert module.share() == tmp_path / "prefix" / "share" / "nao_lipm_gait"


def test_found_by_ament(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ament_index_python")
    prefix = tmp_path / "overlay"
    fill(prefix / "share" / "nao_lipm_gait")
    marker = prefix / "share" / "ament_index" / "resource_index" / "packages" / "nao_lipm_gait"
    marker.parent.mkdir(parents=True)
    marker.write_text("")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))
    module = Installation(tmp_path / "elsewhere" / "nao_lipm_gait", None).load()
    assert module.share() == prefix / "share" / "nao_lipm_gait"


def test_a_folder_of_another_project_is_not_taken_for_ours(tmp_path: Path) -> None:
    site = tmp_path / "venv" / "lib" / "python3.12" / "site-packages"
    (site / "config").mkdir(parents=True)
    (site / "config" / "settings.yaml").write_text("")
    installation = Installation(site / "nao_lipm_gait", tmp_path / "venv/share/nao_lipm_gait")
    assert installation.load().share() == tmp_path / "venv" / "share" / "nao_lipm_gait"


def test_found_nowhere_names_where_it_looked(tmp_path: Path) -> None:
    module = Installation(tmp_path / "ws" / SITE, None).load()
    with pytest.raises(NaoGaitError) as refused:
        module.share("urdf")
    for folder in ("ws/lib/python3.12/site-packages", "ws/share/nao_lipm_gait",
                   "no_prefix/share/nao_lipm_gait"):  # fmt: skip
        assert str(tmp_path / folder) in refused.value.allowed


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_make_uses_the_python_that_is_named_or_none(tmp_path: Path) -> None:
    shutil.copy(Path(__file__).parents[2] / "Makefile", tmp_path)
    for name in ("setup.py", "setup.cfg", "pyproject.toml"):
        (tmp_path / name).touch()
    shim = tmp_path / "python3.12"  # as pyenv's of a version that is not active
    shim.write_text("#!/bin/sh\nexit 127\n")
    shim.chmod(0o755)

    def make(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(["make", *words], cwd=tmp_path, capture_output=True, text=True)

    done = make("install", f"PYTHON={shim}")
    assert done.returncode == 2
    assert f"PYTHON={shim} does not run" in done.stderr
    assert not (tmp_path / ".venv").exists()
    bin_folder = tmp_path / ".venv" / "bin"
    bin_folder.mkdir(parents=True)
    (bin_folder / "python").symlink_to(sys.executable)
    (tmp_path / ".venv" / ".installed").touch()
    done = make("-n", "demo", f"PYTHON={shim}")
    assert "set up with another Python" in done.stderr
    assert done.returncode == 2
    assert make("-n", "demo", f"PYTHON={sys.executable}").returncode == 0
    assert make("-n", "clean", f"PYTHON={shim}").returncode == 0
