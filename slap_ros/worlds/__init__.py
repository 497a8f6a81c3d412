# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds that are stepped, and what they share: the Panda, bodies, features, pictures.

``joint_space``: an arm that follows joint commands among rigid bodies. ``contact``: a hand that
acts by forces. Neither imports the other.
"""
