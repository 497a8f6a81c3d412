# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m slap_ros.cli``."""

from slap_ros.cli import main

main()
