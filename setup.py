"""Build description for both roads: colcon on an apt ROS 2 Jazzy, and pip on PyPI's ROS wheels.

colcon calls this file with dependency handling off and takes dependencies from package.xml, so the
ROS wheels in `install_requires` never reach an apt Jazzy. There, use colcon and not pip: the wheels
would come to lie over the system's rclpy.
"""

from pathlib import Path

from setuptools import find_packages, setup

NAME = "nao_lipm_gait"

PACKAGES = (
    "robot_core", NAME, "nao_soccer", "lola_bridge", "rcss_bridge", "sim_bridge", "gait_lab"
)
SHARED_FOLDERS = ("config", "urdf", "launch", "examples")

# `.ci/try_wheel` passes with all lower bounds; numpy and pin of an apt Jazzy may be older.
CORE = (
    "attrs>=23", "msgpack>=1.0,<2", "numpy>=2.2", "pin>=3.3.1", "pybullet>=3.2.7", "pyyaml>=6.0"
)

ROS = (
    # Exact: these wheels are one binary build and break when mixed.
    "ros-jazzy-rclpy==7.1.6",
    "ros-rclpy[fastrtps]==7.1.6",
    "ros-jazzy-common-interfaces==5.3.6",
    "ros-rosgraph-msgs~=2.0.3",
    "ros-rcl-interfaces~=2.0.3",
    # rosidl and ament_index_python import it at run time; a fresh 3.12 venv has none.
    "setuptools>=65,<81",
)

# By this name colcon recognises that `colcon test` is to call pytest.
TEST = ["filterpy>=1.4.5", "hypothesis>=6.100", "pytest>=8", "pytest-xdist>=3.6", "scipy>=1.13"]

EXTRAS = {
    "mujoco": ["mujoco>=4,<5"],  # the second physics engine; 4 changed what joint.damping is
    "gym": ["gymnasium>=1,<2", "mujoco>=4,<5"],  # gymnasium.make("nao_lipm_gait/Walk-v0")
    "policy": ["mujoco>=4,<5", "onnxruntime>=1.20,<2"],  # bench peers --policy
    "vision": ["opencv-python-headless>=4.10.0.84,<6"],
    "lab": [
        "hypothesis>=6.100",  # bench fuzz
        "joblib>=1.3",
        "jupyter-threejs-sage>=130",  # three.js as a file, for the replay of a match
        "matplotlib>=3.8",
        "mcap-ros2-support>=0.5",
        "opencv-python-headless>=4.10.0.84,<6",  # every suite of bench is imported
        "pillow>=10",
        "plotly>=5.15,<8",
        "rosbags>=0.11,<0.12",
        "tabulate>=0.9",
        "tqdm>=4.66",
    ],
    "tune": [
        "cmaes>=0.10",
        "mujoco>=4,<5",
        "optuna>=4,<5",
        "plotly>=5.15,<8",
        "scikit-learn>=1.4",
        "scipy>=1.13",
        "tqdm>=4.66",
    ],
    "test": TEST,
    "browser": ["playwright>=1.40"],  # tests that look at pages; needs a Chromium
    "docs": ["mkdocs-material>=9.5,<10"],
    "video": ["imageio-ffmpeg>=0.5", "mujoco>=4,<5", "pillow>=10.1"],  # nao_gait match --video
    "view": ["rosbags>=0.11,<0.12", "viser>=1.1,<2"],
    "dev": [
        *TEST,
        "mypy>=1.10",
        "onnx>=1.17",  # its tests write networks
        "onnxruntime>=1.20,<2",
        "ruff>=0.6",
        "types-PyYAML",
        "types-tabulate",
    ],
}


def shared_files() -> list[tuple[str, list[str]]]:
    """(target folder, files) for everything that is installed below share/."""
    by_folder: dict[str, list[str]] = {}
    for top in SHARED_FOLDERS:
        for path in sorted(Path(top).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                folder = f"share/{NAME}/{path.parent.as_posix()}"
                by_folder.setdefault(folder, []).append(path.as_posix())
    return sorted(by_folder.items())


setup(
    name=NAME,
    version="0.3.0",
    description="Humanoids that walk with the CoM-observing 3D-LIPM gait of Graf and Roefer",
    # `colcon build --symlink-install` runs this file from a folder of links without the README.
    long_description=Path(__file__).resolve().with_name("README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    keywords=["humanoid", "walking", "robotics", "ros2", "robocup", "nao", "bipedal"],
    classifiers=[
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: Python :: 3.11",
        "Programming Language :: Python :: 3.12",
        "Topic :: Scientific/Engineering",
    ],
    license="Apache-2.0",
    maintainer="The nao_lipm_gait authors",
    maintainer_email="maintainers@users.noreply.h-seed-ee39dd6e.example",
    python_requires=">=3.11",
    packages=find_packages(
        include=[f"{top}*" for top in PACKAGES]
    ),
    package_data={"gait_lab.report": ["assets/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *shared_files(),
    ],
    install_requires=[*CORE, *ROS],
    extras_require=EXTRAS,
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "gait = nao_lipm_gait.ros.main:main",
            "sim_bridge = sim_bridge.ros.main:main",
            "lola_bridge = lola_bridge.ros.main:main",
            "lola_server = sim_bridge.lola.main:main",
            "vision = nao_soccer.ros.vision_main:main",
            "player = nao_soccer.ros.player_main:main",
            "robot = gait_lab.soccer.robot_main:main",
            "referee = nao_soccer.ros.referee_main:main",
            "nao_gait = gait_lab.cli:main",
        ],
    },
)
