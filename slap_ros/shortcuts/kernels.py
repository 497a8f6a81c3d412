# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What observations of many states take longest to compute, as compiled code."""

from __future__ import annotations

import numpy as np

from slap_ros.compilation import compiled
from slap_ros.relational.state import Array


@compiled
def largest_shares(deficits: Array, shares: Array) -> Array:
    """See :func:`slap_ros.shortcuts.shaping_potential.largest_shares`: the same bits."""
    atoms, objects = shares.shape
    largest = np.empty((len(deficits), objects))
    for i in range(len(deficits)):
        for j in range(objects):
            most = deficits[i, 0] * shares[0, j]
            for k in range(1, atoms):
                most = max(most, deficits[i, k] * shares[k, j])
            largest[i, j] = most
    return largest
