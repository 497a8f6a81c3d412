# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m perception_node``."""

import sys

from perception_node.node import main

sys.exit(main())
