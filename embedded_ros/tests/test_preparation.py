# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is prepared is not worked out anew by a node."""

import os
import subprocess
import sys

import pytest

NODE = """
from cyclonedds.idl import _main, _xt_builder
from example_interfaces.action import Fibonacci
from std_msgs.msg import String
from std_srvs.srv import Trigger
import rclpy
from rclpy.action import ActionClient
from embedded_ros.preparation import prepare

prepare([Fibonacci, String, Trigger])
_xt_builder.XTBuilder.process_type = None  # calling it is an error
rclpy.init()
node = rclpy.create_node("prepared")
node.create_publisher(String, "words", 1)
node.create_client(Trigger, "trigger")
ActionClient(node, Fibonacci, "fibonacci")
print("made")
rclpy.shutdown()
"""


def run(code, cache):
    environment = os.environ | {"XDG_CACHE_HOME": str(cache)}
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=30)


def test_a_nodes_topics_need_nothing_that_was_not_prepared(tmp_path):
    ran = run(NODE, tmp_path)
    assert ran.stdout == "made\n", ran.stderr


def test_an_interface_that_was_not_prepared_is_missed(tmp_path):
    code = NODE.replace("prepare([Fibonacci, String, Trigger])", "prepare([Fibonacci, Trigger])")
    assert "NoneType" in run(code, tmp_path).stderr


def test_another_process_needs_no_preparation(tmp_path):
    assert run(NODE, tmp_path).stdout == "made\n"
    unprepared = NODE.replace("prepare([Fibonacci, String, Trigger])", "")
    ran = run(unprepared, tmp_path)
    assert ran.stdout == "made\n", ran.stderr


TOLD = """
from std_srvs.srv import Trigger
from embedded_ros.transport.descriptors import topic_descriptor

descriptor = topic_descriptor(f"{Trigger.ros_type}_Response", service=True)
print(*(part.hex() for part in descriptor.__idl__._xt_bytedata))
"""


@pytest.mark.parametrize("damage", [lambda _: b"", lambda whole: whole[:-1], bytes.swapcase])
def test_damage_is_noticed_and_mended(tmp_path, damage):
    told = run(TOLD, tmp_path).stdout
    assert told.strip()
    (file,) = (path for path in tmp_path.rglob("*") if path.is_file())
    whole = file.read_bytes()
    assert run(TOLD, tmp_path).stdout == told
    file.write_bytes(damage(whole))
    assert run(TOLD, tmp_path).stdout == told
    assert file.read_bytes() == whole


def test_nothing_is_needed_on_disk(tmp_path):
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    assert run(TOLD, nowhere).stdout == run(TOLD, tmp_path / "cache").stdout != ""
