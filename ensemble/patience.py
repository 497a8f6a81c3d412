# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much longer than usual to wait: a factor of all deadlines. Imported without ROS."""

from __future__ import annotations

import os

IMPATIENT, PATIENT = 0.01, 1e4  # the least and the most
USUAL_IMPORT = 0.5  # s that the import of one of our domains takes where nothing else runs
MOST_GROWN = 10.0  # above which the factor does not grow by itself


def grown_patience(import_s: float) -> float:
    """The factor where none is given: it grows as the start becomes slower than usual.

    Args:
        import_s: Seconds that the import of the domain took, on this machine and with its load.
    """
    return min(max(1.0, import_s / USUAL_IMPORT), MOST_GROWN)


def load_advice() -> str:
    """What to say after a deadline passed that the machine's load can break: cause and way out."""
    try:
        measured = f" ({os.getloadavg()[0]:.1f} on {os.cpu_count()} processors)"
    except OSError:  # not every system tells
        measured = ""
    return (
        f"a likely cause is the machine's load{measured}: give a larger --patience, which is the "
        "parameter patience of nodes and launch file"
    )
