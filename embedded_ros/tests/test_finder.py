# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Importing: ours where there is no ROS 2, nothing at all where there is one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Process

Run = Callable[..., Process]


def outcome(process: Process) -> str:
    code, out, err = process.finish()
    return out.strip() if code == 0 else err.strip().splitlines()[-1]


@pytest.fixture
def real_rclpy(tmp_path: Path) -> Path:
    """A folder with a stand-in for ROS 2's own packages."""
    for package in ("rclpy", "std_msgs"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("REAL = True\n")
    return tmp_path


def test_a_real_rclpy_wins(run: Run, real_rclpy: Path) -> None:
    code = "import rclpy, std_msgs; print(rclpy.REAL, std_msgs.REAL)"
    assert outcome(run(code=code, PYTHONPATH=str(real_rclpy))) == "True True"


@pytest.mark.parametrize("first", ["", "import rclpy; "])
def test_beside_a_real_rclpy_nothing_is_provided(run: Run, real_rclpy: Path, first: str) -> None:
    last = outcome(run(code=f"{first}import sensor_msgs.msg", PYTHONPATH=str(real_rclpy)))
    assert last.startswith("ModuleNotFoundError: No module named 'sensor_msgs': ROS 2's own rclpy")
    assert "build sensor_msgs with colcon" in last


def test_what_is_not_covered_says_so(run: Run) -> None:
    last = outcome(run(code="import rclpy.lifecycle"))
    assert "'rclpy.lifecycle': it is not part of embedded_ros; source a ROS 2" in last
    last = outcome(run(code="import rclpy; rclpy.create_subscription"))
    assert "it is not part of embedded_ros" in last


def test_other_missing_modules_are_none_of_our_business(run: Run) -> None:
    assert outcome(run(code="import no_such_msgs")).endswith("No module named 'no_such_msgs'")


def test_starting_an_interpreter_stays_cheap(run: Run) -> None:
    heavy = ("numpy", "cyclonedds", "rosbags", "importlib.metadata", "typing")
    code = f"import sys; print([m for m in {heavy} if m in sys.modules])"
    assert outcome(run(code=code)) == "[]"


def test_interfaces_from_the_environment(run: Run, tmp_path: Path) -> None:
    (tmp_path / "srv").mkdir()
    (tmp_path / "srv" / "Ask.srv").write_text("string question\n---\nstring answer yes\n")
    code = "from env_msgs.srv import Ask; print(Ask.Response().answer)"
    assert outcome(run(code=code, EMBEDDED_ROS_INTERFACES=f"env_msgs={tmp_path}")) == "yes"


def test_interfaces_from_an_entry_point(run: Run, tmp_path: Path) -> None:
    """As an installed distribution registers them, without __init__.py beside its folders."""
    (tmp_path / "some_schemas" / "msg").mkdir(parents=True)
    (tmp_path / "some_schemas" / "msg" / "Thing.msg").write_text("uint16 CODE=7\n")
    information = tmp_path / "some-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: some\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(
        "[embedded_ros.interfaces]\nsome_msgs = some_schemas\n"
    )
    code = "from some_msgs.msg import Thing; print(Thing.CODE)"
    assert outcome(run(code=code, PYTHONPATH=str(tmp_path))) == "7"


def test_a_malformed_file_is_named_with_its_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg" / "Bad.msg").write_text("int32 ok\nint33 wrong\n")
    (tmp_path / "msg" / "Dangling.msg").write_text("NoSuchThing thing\n")
    environment = {"EMBEDDED_ROS_INTERFACES": f"env_msgs={tmp_path}"}
    last = outcome(run(code="from env_msgs.msg import Bad", **environment))
    assert f"{tmp_path}/msg/Bad.msg:2: env_msgs/msg/Bad: type 'int33' is unknown" in last
    last = outcome(run(code="from env_msgs.msg import Dangling", **environment))
    assert "env_msgs/msg/Dangling.thing: no source of interfaces knows env_msgs/msg/NoSu" in last


@pytest.mark.parametrize("value", ["env_msgs", "env_msgs=/no/such/folder"])
def test_a_wrong_environment_variable_says_so(run: Run, value: str) -> None:
    last = outcome(run(code="from env_msgs.msg import A", EMBEDDED_ROS_INTERFACES=value))
    assert "EMBEDDED_ROS_INTERFACES" in last


def test_what_cannot_be_encrypted_is_not_sent(run: Run) -> None:
    code = "import rclpy; rclpy.init()"
    assert "embedded_ros has no SROS 2" in outcome(run(code=code, ROS_SECURITY_ENABLE="true"))
