# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A hand that acts by forces. Read on in this order: ``scene``, ``hand``, ``features``, ``world``.

``scene``, ``hand`` and ``features`` need no simulator; ``world`` uses PyBullet.
"""
