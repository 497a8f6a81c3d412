# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Panda among rigid bodies. Read on in this order: ``pose``, ``panda``, ``scene``, ``world``.

``pose``, ``panda`` and ``scene`` need no simulator; ``world`` and ``rendering`` use PyBullet.
"""
