# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Franka arm by its own protocol, without ROS: limits, faults, the arm, a simulated FR3.

``settings.py``, ``faults.py``, ``arm.py``; then ``simulation.py`` and the program that it starts,
``simulated_fr3.py``.
"""
