# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m ensemble.cli``."""

from ensemble.cli import main

main()
