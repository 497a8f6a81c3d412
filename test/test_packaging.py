# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What colcon and pip see."""

import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

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
        "colcon_defaults.yaml",
    ):
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / "test/shortcuts/data/obstacle2d", tmp_path / "models" / "obstacle2d")
    return tmp_path


NODES = (
    "sim_node",
    "perception_node",
    "planner_node",
    "skill_server",
    "recorder_node",
    "robot_bridge",
)
PACKAGE_FOLDERS = ("slap_ros", "ensemble", *NODES, "msg_schemas", "resource", "launch", "config")


def test_colcon_sees_both_packages_with_their_build_types(checkout):
    """An invalid package.xml would silently be taken for a plain Python package."""
    listed = colcon("list", cwd=checkout).split("\n")
    kinds = {line.split("\t")[0]: line.split("\t")[2] for line in listed if line}
    assert kinds == {"slap_ros": "(ros.ament_python)", "slap_msgs": "(ros.ament_cmake)"}


@pytest.mark.parametrize("options", [[], ["--symlink-install"]], ids=["plain", "symlinks"])
def test_colcon_builds_executables_where_ros2_run_looks_for_them(checkout, options, tmp_path):
    # slap_msgs needs ament_cmake to be built; colcon is content with a sign that it was.
    built = checkout / "install" / "slap_msgs" / "share" / "slap_msgs"
    built.mkdir(parents=True)
    (built / "package.sh").touch()
    colcon("build", "--packages-select", "slap_ros", *options, cwd=checkout)
    installed = checkout / "install" / "slap_ros"
    assert (installed / "share/ament_index/resource_index/packages/slap_ros").exists()
    assert (installed / "share/slap_ros/launch/ensemble.launch.py").exists()
    models = installed / "share/slap_ros/models/obstacle2d"
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


def test_manifests_agree_on_name_version_and_licence():
    import slap_ros

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
