# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Panda among rigid bodies. Read on in this order: ``panda``, ``scene``, ``snapshot``, ``world``.

``world`` and ``rendering`` use PyBullet; the others need no simulator.
"""
