# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap``: where it begins. The commands are in :mod:`ensemble.cli.application`."""

from __future__ import annotations

from slap_ros.signals import exit_at_once_on_signals


def main() -> None:
    """Run a command of ``slap``."""
    exit_at_once_on_signals()
    from ensemble.cli.application import run  # seconds, on a busy machine

    run()
