# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m robot_bridge.servo``."""

import sys

from ensemble.startup import main_of


def main() -> int:
    """Run the node."""
    return main_of("robot_bridge.servo")


if __name__ == "__main__":
    sys.exit(main())
