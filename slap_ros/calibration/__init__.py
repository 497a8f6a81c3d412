# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a real table is like: friction of the planner's model, identified from recorded pushes.

Read ``pushes`` (what counts as a push in a bag), then ``friction`` (least squares over roll-outs of
the same pushes), then ``settings`` (the file that simulator and planner take).
"""
