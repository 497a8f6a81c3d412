# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is prepared is not worked out anew by a node."""

import subprocess
import sys

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


def test_a_nodes_topics_need_nothing_that_was_not_prepared():
    ran = subprocess.run([sys.executable, "-c", NODE], capture_output=True, text=True, timeout=30)
    assert ran.stdout == "made\n", ran.stderr


def test_an_interface_that_was_not_prepared_is_missed():
    code = NODE.replace("prepare([Fibonacci, String, Trigger])", "prepare([Fibonacci, Trigger])")
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert "NoneType" in ran.stderr
