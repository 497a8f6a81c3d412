# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m robot_bridge.mock``."""

import sys

from robot_bridge.mock.node import main

sys.exit(main())
