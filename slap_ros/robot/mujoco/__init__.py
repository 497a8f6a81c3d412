# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Panda and what stands around it in MuJoCo: a robot to try on that is not our own physics.

Nothing here knows what the planner predicts: bodies move by contact alone. Read ``arm``, ``model``,
then ``plant``; then ``closed_loop``, which executes plans by what is measured while the arm stands,
``contact_loop``, which does so while it moves, or ``open_loop``, which plays recorded motions
without looking.
"""
