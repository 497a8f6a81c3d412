# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What domains of a Panda at a table have in common.

``reading``: the parts of a state; ``scene``: what the arm keeps clear of, as a domain says;
``grasps`` and ``places``: where the hand is to go; ``ways``: how it gets there; ``timing``: how
fast; ``skills``: what it does then. ``observation`` is for learners, ``showing`` for people.
"""
