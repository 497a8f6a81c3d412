# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishes and listens until it is told to end: ``lonely_node.py NAME FOLDER``.

In the folder there is a file ``NAME.up`` once it has heard itself, and ``NAME.heard`` once it has
heard somebody else too. It ends when there is a file ``end``.
"""

import sys
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import String

from ensemble.network import first_node, join_network

name, folder, heard = sys.argv[1], Path(sys.argv[2]), set()
join_network()
node = first_node(lambda: rclpy.create_node(name))
node.create_subscription(String, "talk", lambda message: heard.add(message.data), 10)
publisher = node.create_publisher(String, "talk", 10)
executor = SingleThreadedExecutor()
executor.add_node(node)
while name not in heard or not (folder / "end").exists():
    executor.spin_once(timeout_sec=0.1)
    publisher.publish(String(data=name))
    if name in heard:
        (folder / f"{name}.up").touch()
        if len(heard) > 1:
            (folder / f"{name}.heard").touch()
sys.stdout.write(f"{name}:{len(heard) > 1}\n")
