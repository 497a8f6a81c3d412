# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Choices among scores from -1 to 1, as policies learn them and as numpy repeats them."""

from __future__ import annotations

import math

SHARPNESS = 5.0  # from scores to logarithms of probabilities
# Standard deviation of the Gumbel noise on scores by which choices have their probabilities.
SCORE_NOISE = math.pi / math.sqrt(6.0) / SHARPNESS
