# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m recorder_node``."""

import sys

from recorder_node.node import main

sys.exit(main())
