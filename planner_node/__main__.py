# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m planner_node``."""

import sys

from planner_node.node import main

sys.exit(main())
