# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishes and listens for a while, then says whether it has heard anybody else."""

import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import String

from ensemble.network import first_node, join_network

WHILE = 10.0  # s, in which others, where they can be found at all, are found many times over

name, heard = sys.argv[1], set()
join_network()
node = first_node(lambda: rclpy.create_node(name))
node.create_subscription(String, "talk", lambda message: heard.add(message.data), 10)
publisher = node.create_publisher(String, "talk", 10)
executor = SingleThreadedExecutor()
executor.add_node(node)
end = time.monotonic() + WHILE
while time.monotonic() < end:
    executor.spin_once(timeout_sec=0.1)
    publisher.publish(String(data=name))
assert name in heard
sys.stdout.write(f"{name}:{len(heard) > 1}\n")
