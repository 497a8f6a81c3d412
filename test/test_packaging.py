# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What colcon and pip see."""

import json
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from email import message_from_bytes
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import slap_ros

ROOT = Path(__file__).parent.parent


def colcon(*arguments, cwd):
    command = [str(Path(sys.executable).parent / "colcon"), *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=True).stdout


@pytest.fixture
def checkout(tmp_path):
    """The packages alone, so that nothing of this checkout's own state matters."""
    ignore = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for name in PACKAGE_FOLDERS:
        shutil.copytree(ROOT / name, tmp_path / name, ignore=ignore)
    for name in (
        "setup.py",
        "setup.cfg",
        "pyproject.toml",
        "package.xml",
        "README.md",
        "LICENSE",
        "colcon_defaults.yaml",
    ):
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.copytree(
        ROOT / "test/shortcuts/data/obstacle2d", tmp_path / "models" / "shortcuts" / "obstacle2d"
    )
    return tmp_path


NODES = (
    "sim_node",
    "perception_node",
    "planner_node",
    "skill_server",
    "acquisition_node",
    "recorder_node",
    "robot_bridge",
)
PACKAGE_FOLDERS = ("slap_ros", "ensemble", *NODES, "msg_schemas", "resource", "launch", "config")


def test_colcon_sees_both_packages_with_their_build_types(checkout):
    """An invalid package.xml would silently be taken for a plain Python package."""
    listed = colcon("list", cwd=checkout).split("\n")
    kinds = {line.split("\t")[0]: line.split("\t")[2] for line in listed if line}
    assert kinds == {"slap_ros": "(ros.ament_python)", "slap_msgs": "(ros.ament_cmake)"}


@pytest.mark.slow
@pytest.mark.timeout(180)  # builds a package
@pytest.mark.parametrize("options", [[], ["--symlink-install"]], ids=["plain", "symlinks"])
def test_colcon_builds_executables_where_ros2_run_looks_for_them(
    checkout, network, options, tmp_path
):
    # slap_msgs needs ament_cmake to be built; colcon is content with a sign that it was.
    built = checkout / "install" / "slap_msgs" / "share" / "slap_msgs"
    built.mkdir(parents=True)
    (built / "package.sh").touch()
    colcon("build", "--packages-select", "slap_ros", *options, cwd=checkout)
    installed = checkout / "install" / "slap_ros"
    assert (installed / "share/ament_index/resource_index/packages/slap_ros").exists()
    assert (installed / "share/slap_ros/launch/ensemble.launch.py").exists()
    models = installed / "share/slap_ros/models/shortcuts/obstacle2d"
    assert {path.name for path in models.iterdir()} == {"library.json", "Clear_On-e41568a9"}
    assert len(list((models / "Clear_On-e41568a9").iterdir())) == 2
    for name in (*NODES, "slap"):
        assert (installed / "lib/slap_ros" / name).exists()
    (packages,) = installed.glob("lib/python3.*/site-packages")
    shapes = "from slap_ros.domains.cleanup_table.shapes import shipped; shipped()"
    away = {**os.environ, "PYTHONPATH": str(packages)}
    subprocess.run([sys.executable, "-c", shapes], env=away, cwd=tmp_path.root, check=True)
    if not options:  # symlinks lead to the sources, with all that is in them
        report = packages / "slap_ros" / "report"
        assert {path.suffix for path in report.glob("page.*")} == {".py", ".css", ".js", ".j2"}
    refused = subprocess.run(
        [installed / "lib/slap_ros/sim_node", "--ros-args", "-p", "domain:=moon"],
        env={**os.environ, "PYTHONPATH": str(packages)},
        cwd=checkout,
        capture_output=True,
        text=True,
    )
    assert refused.returncode == 10, refused.stderr


def build(source, folder):
    """Make the sdist, and from it the wheel, as whoever publishes does."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder)]
    subprocess.run([*command, str(source)], check=True, capture_output=True)


def requirements(wheel, extra=""):
    """The distributions, by name, that a wheel's installation brings along, all the way down."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        found = message_from_bytes(archive.read(name)).get_all("Requires-Dist", [])
    queue, seen = found, set()
    while queue:
        wanted = Requirement(queue.pop())
        if wanted.name in seen or (wanted.marker and not wanted.marker.evaluate({"extra": extra})):
            continue
        seen.add(wanted.name)
        queue.extend(metadata.distribution(wanted.name).requires or [])
    return seen


def install(names, folder):
    """Put installed distributions, and nothing else, into a folder: no index is asked."""
    folder.mkdir()
    for name in names:
        distribution = metadata.distribution(name)
        for top in {Path(file).parts[0] for file in distribution.files if ".." not in str(file)}:
            if top != "__pycache__" and not (folder / top).exists():
                (folder / top).symlink_to(distribution.locate_file(top))


EVERY_ENVIRONMENT = """
import sys, gymnasium, slap_ros.environments
names = [name for name in gymnasium.registry if name.startswith("slap_ros/")]
for name in names:
    gymnasium.make(name)
print(len(names), "torch" in sys.modules)
"""


@pytest.mark.slow
@pytest.mark.timeout(420)  # builds two distributions, and starts an ensemble and learners' worlds
def test_the_published_wheels_run_in_an_empty_environment(checkout, tmp_path, network):
    """With what they require and no more, away from any checkout, shipped shortcuts included."""
    shutil.rmtree(checkout / "models")
    shutil.copytree(ROOT / "models", checkout / "models")
    shutil.copytree(ROOT / "embedded_ros", checkout / "embedded_ros")
    dist = tmp_path / "dist"
    for source in (checkout, checkout / "embedded_ros"):
        build(source, dist)
    wheels = sorted(dist.glob("*.whl"))
    names = [f"{name}-{slap_ros.__version__}" for name in ("embedded_ros", "slap_ros")]
    ends = ("-py3-none-any.whl", ".tar.gz")
    assert {path.name for path in dist.iterdir()} == {n + end for n in names for end in ends}

    python = tmp_path / "venv/bin/python"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "-q", "--no-deps"]
    subprocess.run([*pip, "--no-index", *map(str, wheels)], check=True)
    libraries = tmp_path / "libraries"
    install(set().union(*map(requirements, wheels)), libraries)

    empty = tmp_path / "empty"
    empty.mkdir()
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "AMENT"))}
    options = ("--seed", "1", "--json", "--patience", "10")  # for a loaded machine
    run = subprocess.run(
        [python.with_name("slap"), "run", "obstacle2d", *options],
        cwd=empty,
        env={**environment, "PYTHONPATH": str(libraries)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    assert result["success"]
    assert result["shortcut_steps"] > 0

    gym = tmp_path / "gym"
    install(set().union(*(requirements(wheel, "gym") for wheel in wheels)), gym)
    made = subprocess.run(
        [python, "-c", EVERY_ENVIRONMENT],
        cwd=empty,
        # Nothing moves: compiling motion planning for this folder would take most of the test.
        env={**environment, "PYTHONPATH": str(gym), "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert made.stdout.split() == ["20", "False"], made.stderr
    assert not list(empty.iterdir())


def test_manifests_agree_on_name_version_and_licence():
    for path in (ROOT / "package.xml", ROOT / "msg_schemas" / "package.xml"):
        root = ET.parse(path).getroot()
        assert root.get("format") == "3"
        assert root.findtext("version") == slap_ros.__version__
        assert root.findtext("license") == "Apache-2.0"


def test_the_core_imports_no_ros():
    """Even where ROS is installed: nothing of it may be loaded by the core and the command line."""
    code = (
        "import sys, pkgutil, importlib, slap_ros\n"
        "for m in pkgutil.walk_packages(slap_ros.__path__, 'slap_ros.'):\n"
        "    if not m.name.endswith(('__main__', 'probe')): importlib.import_module(m.name)\n"
        "bad = [m for m in sys.modules if m.split('.')[0] in "
        "('rclpy', 'slap_msgs', 'std_msgs', 'cyclonedds', 'ensemble')]\n"
        "sys.exit(str(bad) if bad else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def required(lines):
    """The distributions that requirements name."""
    return {re.match(r"[\w.-]+", line)[0] for line in lines if line[:1].isalpha()}


def test_what_rosdep_does_not_give_is_what_the_readme_installs():
    setup = (ROOT / "setup.py").read_text()
    lists = [re.search(rf"^{name} = \[(.*?)^\]", setup, re.M | re.S)[1] for name in LISTS]
    needed = required(re.findall(r'^    "(.+)",', "\n".join(lists), re.M))
    by_pip = required((ROOT / "requirements-ros.txt").read_text().splitlines())
    depends = ET.parse(ROOT / "package.xml").getroot().findall("exec_depend")
    by_rosdep = {tag.text.removeprefix("python3-").replace("yaml", "pyyaml") for tag in depends}
    assert needed <= by_pip | by_rosdep
    assert by_pip <= needed


def test_rosdep_gives_what_the_launch_file_imports_and_runs():
    launched = (ROOT / "launch" / "ensemble.launch.py").read_text()
    used = {name for name in re.findall(r"^from (\w+)", launched, re.M) if name not in STANDARD}
    used |= set(re.findall(r'package="(\w+)"', launched)) | {"ros2launch"}  # what runs it
    depends = ET.parse(ROOT / "package.xml").getroot().findall("exec_depend")
    assert used - {"slap_ros"} <= {tag.text for tag in depends}


STANDARD = sys.stdlib_module_names
LISTS = ("RUNTIME", "PHYSICS")
