# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m skill_server``."""

import sys

from skill_server.node import main

sys.exit(main())
