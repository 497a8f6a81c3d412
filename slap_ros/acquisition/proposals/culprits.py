# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A complaint about operators together, and which of them are to be asked for again."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass

SUBJECT = "operators"


@dataclass(frozen=True)
class Culprits:
    """A complaint, and who is at fault.

    Args:
        complaint: What is wrong.
        operators: Names of the operators that are to be asked for again.
    """

    complaint: Complaint
    operators: frozenset[str]

    @classmethod
    def of(cls, kind: ComplaintClass, fact: str, *operators: str) -> Culprits:
        """The culprits of a complaint about operators, or about all of them where none is named.

        Args:
            kind: Class of the complaint.
            fact: What is wrong.
            operators: Names of the operators.
        """
        subject = f"operator {' and '.join(operators)}" if operators else SUBJECT
        return cls(Complaint(kind, subject, fact), frozenset(operators))
