# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m robot_bridge``."""

import sys

from robot_bridge.node import main

sys.exit(main())
