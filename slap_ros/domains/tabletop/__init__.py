# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What domains of a Panda at a table have in common.

``state_access``: the parts of a state; ``planning_scene``: what the arm keeps clear of, as a domain
says; ``grasps`` and ``placements``: where the hand is to go; ``transit``: how it gets there;
``timing``: how fast; ``skills``: what it does then; ``presets``: all that in ``fair`` and
``paper``; ``model``: the domain that all this makes. ``footprints`` and ``scalar_box``: boxes
seen from above, for predicates. ``observation`` is for learners, ``visualization`` for people.
"""
