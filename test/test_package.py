"""The two descriptions of the package agree, and what they promise is there."""

import ast
import importlib
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import nao_lipm_gait

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = {
    "gait": "nao_lipm_gait.ros.main:main",
    "sim_bridge": "sim_bridge.ros.main:main",
    "lola_bridge": "lola_bridge.ros.main:main",
    "lola_server": "sim_bridge.lola.main:main",
    "vision": "nao_soccer.ros.vision_main:main",
    "player": "nao_soccer.ros.player_main:main",
    "referee": "nao_soccer.ros.referee_main:main",
    "robot": "gait_lab.soccer.robot_main:main",
    "nao_gait": "gait_lab.cli:main",
}


class _Setup:
    """The arguments of setup() as setup.py computes them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        import setuptools

        self.arguments: dict = {}
        monkeypatch.setattr(setuptools, "setup", self.arguments.update)
        monkeypatch.chdir(ROOT)
        file = ROOT / "setup.py"
        exec(
            compile(file.read_text(), "setup.py", "exec"),
            {"__name__": "setup", "__file__": str(file)},
        )


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> dict:
    return _Setup(monkeypatch).arguments


def package_xml() -> ET.Element:
    return ET.parse(ROOT / "package.xml").getroot()


def text(element: ET.Element, path: str) -> str:
    return (element.findtext(path) or "").strip()


def test_name_version_and_license_agree(setup: dict):
    package = package_xml()
    assert text(package, "name") == setup["name"]
    assert text(package, "version") == setup["version"] == nao_lipm_gait.__version__
    assert text(package, "license") == setup["license"]
    assert text(package, "export/build_type") == "ament_python"


def test_scripts_lead_to_functions(setup: dict):
    scripts = dict(
        re.split(r"\s*=\s*", line) for line in setup["entry_points"]["console_scripts"]
    )
    assert scripts == SCRIPTS
    for target in scripts.values():
        module, function = target.split(":")
        assert callable(getattr(importlib.import_module(module), function))


def test_every_shared_file_is_installed(setup: dict):
    installed = {
        f"{folder.removeprefix('share/nao_lipm_gait').strip('/')}/{Path(file).name}".lstrip("/")
        for folder, files in setup["data_files"]
        for file in files
    }
    for top in ("config", "urdf", "launch"):
        for path in (ROOT / top).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert path.relative_to(ROOT).as_posix() in installed
    assert "package.xml" in installed
    folders = dict(setup["data_files"])
    marker = "share/ament_index/resource_index/packages"
    assert folders[marker] == ["resource/nao_lipm_gait"], "ros2 finds packages by this file"


def test_every_package_is_installed(setup: dict):
    for top in FLOORS:
        for init in (ROOT / top).rglob("__init__.py"):
            assert init.parent.relative_to(ROOT).as_posix().replace("/", ".") in setup["packages"]
        for module in (ROOT / top).rglob("*.py"):
            assert (module.parent / "__init__.py").exists(), f"{module} would not be installed"
    assert not any(name.startswith("test") for name in setup["packages"])


def _imports(folder: str) -> set[str]:
    return set().union(*map(_imports_of, (ROOT / folder).rglob("*.py")))


def _imports_of(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found


ROSDEP_KEYS = {
    "cv2": "python3-opencv",
    "msgpack": "python3-msgpack",
    "numpy": "python3-numpy",
    "yaml": "python3-yaml",
    "pybullet": "python3-pybullet-pip",
    "pinocchio": "pinocchio",
    "matplotlib": "python3-matplotlib",
    "rosbags": "python3-rosbags-pip",
    "joblib": "python3-joblib",
    "tabulate": "python3-tabulate",
    "tqdm": "python3-tqdm",
    "PIL": "python3-pil",
    "mcap_ros2": "mcap-ros2-support",
    "launch": "launch",
    "launch_ros": "launch_ros",
    "tf2_ros": "tf2_ros_py",
    "builtin_interfaces": "builtin_interfaces",
    "rclpy": "rclpy",
    "ament_index_python": "ament_index_python",
}


KNOWN_TO_ROSDEP = {
    "pinocchio", "python3-attrs", "python3-filterpy-pip", "python3-gymnasium-pip",
    "python3-hypothesis", "python3-joblib", "python3-matplotlib", "python3-msgpack",
    "python3-mujoco-pip", "python3-numpy", "python3-opencv", "python3-pil",
    "python3-pybullet-pip", "python3-pytest", "python3-pytest-xdist", "python3-rosbags-pip",
    "python3-scipy", "python3-tabulate", "python3-tqdm", "python3-yaml", "mcap-ros2-support",
}  # fmt: skip
"""Keys that resolve on Ubuntu 24.04 by the rosdistro of August 2026; one that does not makes rosdep
install nothing at all."""
OF_JAZZY = re.compile(r"\w+_(msgs|srvs|interfaces|py)|rclpy|launch(_ros)?|ros2launch|ament_.*")


def test_rosdep_resolves_every_dependency():
    keys = {element.text for element in package_xml().iter() if element.tag.endswith("_depend")}
    assert not {key for key in keys - KNOWN_TO_ROSDEP if not OF_JAZZY.fullmatch(str(key))}


def test_package_xml_depends_on_what_is_imported():
    depends = {element.text for element in package_xml().iter() if element.tag.endswith("_depend")}
    imported = set().union(*map(_imports, FLOORS))
    for module in imported:
        key = ROSDEP_KEYS.get(module)
        if key is None and module.endswith(("_msgs", "_srvs")):
            key = module
        if key is not None:
            assert key in depends, f"import {module}"


FLOORS = {
    "robot_core": set(),
    "nao_lipm_gait": {"robot_core"},
    "nao_soccer": {"robot_core"},
    "lola_bridge": {"robot_core"},
    "rcss_bridge": {"robot_core"},
    "sim_bridge": {"robot_core", "nao_lipm_gait", "lola_bridge"},
    "gait_lab": {
        "robot_core", "nao_lipm_gait", "nao_soccer", "lola_bridge", "rcss_bridge", "sim_bridge"
    },
}
"""What each package may import; ground truth and physics never get below the simulator."""
SIMULATORS = {"pybullet", "mujoco"}


@pytest.mark.parametrize("top", FLOORS)
def test_a_package_imports_only_from_the_floors_below(top: str):
    above = FLOORS.keys() - FLOORS[top] - {top}
    for path in (ROOT / top).rglob("*.py"):
        # The public names come from two floors; those of the upper one are imported when used.
        allowed = {"sim_bridge"} if path == ROOT / "nao_lipm_gait" / "__init__.py" else set()
        assert _imports_of(path) & above <= allowed, path
        # MuJoCo reads its own format when a robot comes as MJCF.
        reads = {"mujoco"} if path == ROOT / "robot_core" / "robot" / "mjcf.py" else set()
        if top not in ("sim_bridge", "gait_lab"):
            assert _imports_of(path) & SIMULATORS <= reads, path


def test_the_public_names_load_no_simulator():
    code = (
        "import sys, nao_lipm_gait as api\n"
        "heavy = {'sim_bridge', 'pybullet', 'mujoco', 'pinocchio', 'rclpy'}\n"
        "assert not heavy & sys.modules.keys(), heavy & sys.modules.keys()\n"
        "assert set(api.__all__) <= set(dir(api))\n"
        "missing = [name for name in api.__all__ if getattr(api, name, None) is None]\n"
        "assert not missing, missing\n"
        "assert 'pybullet' not in sys.modules and 'mujoco' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("top", FLOORS)
def test_only_the_folders_named_ros_import_ros(top: str):
    """The cores run without ROS; the tools of the lab drive nodes and read bags."""
    ros = {"rclpy", "std_msgs", "sensor_msgs", "geometry_msgs", "nav_msgs", "rosgraph_msgs"}
    for path in (ROOT / top).rglob("*.py"):
        if top != "gait_lab" and not {"ros", "lola"} & set(path.relative_to(ROOT).parts):
            assert not _imports_of(path) & ros, path


def test_every_node_parameter_is_documented():
    from nao_lipm_gait.ros import node
    from sim_bridge.ros import node as bridge

    text = (ROOT / "docs" / "ros.md").read_text(encoding="utf-8")
    gait, robot = text.split("## `sim_bridge`")
    for section, parameters in ((gait, node.NODE_PARAMETERS), (robot, bridge.NODE_PARAMETERS)):
        for parameter in parameters:
            assert f"| `{parameter.name}` |" in section, parameter.name


def _anchor(heading: str) -> str:
    """The anchor that GitHub gives a heading."""
    text = re.sub(r"[`*]|\[([^]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


@pytest.mark.parametrize(
    "page", [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "urdf" / "README.md"],
    ids=lambda page: page.name,
)  # fmt: skip
def test_links_of_the_documents_lead_somewhere(page: Path):
    text = page.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.exists(), link
        if anchor:
            headings = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in map(_anchor, headings), link


def test_source_files_that_the_documents_name_exist():
    files = {path.relative_to(ROOT).as_posix() for path in ROOT.glob("[a-z]*/**/*.py")}
    for page in ("docs/architecture.md", "docs/method.md", "docs/soccer.md", "CONTRIBUTING.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        for name in re.findall(r"`([\w/]+\.py)`", text):
            assert any(f"/{each}".endswith(f"/{name}") for each in files), f"{page}: {name}"
