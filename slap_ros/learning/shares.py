# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dividing environments among pools of starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def proportional_shares(sizes: Sequence[int], count: int) -> list[int]:
    """A share of ``count`` for each pool, in proportion, the largest remainders rounded up."""
    exact = np.array(sizes) * count / sum(sizes)
    shares = np.floor(exact).astype(int)
    for i in np.argsort(shares - exact, kind="stable")[: count - shares.sum()]:
        shares[i] += 1
    return [int(share) for share in shares]
