# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The finding of one check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Status = Literal["ok", "warning", "problem"]


@dataclass(frozen=True)
class Check:
    """What was looked at, how it stands, what was found, and what to do about it.

    A *problem* keeps the ensemble from running; a *warning* concerns a part of it, or may cause
    trouble later.
    """

    name: str
    status: Status
    found: str
    advice: str = ""  # empty where there is nothing to do
