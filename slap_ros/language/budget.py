# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one task may spend on a language model, and what is left of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError
from slap_ros.language.request import Reply


@dataclass(frozen=True)
class BudgetLimits:
    """The most that one task may spend.

    Args:
        attempts: Answers asked for. Repetitions after a busy server or a lost connection are part
            of one attempt.
        tokens: Tokens of questions and answers together. An answer's length is known when it is
            there, so the last one may exceed this; no other is asked for then.
        seconds: Waiting for answers, pauses included. A wait ends when they are spent.
    """

    attempts: int = 40
    tokens: int = 400_000
    seconds: float = 900.0

    def __post_init__(self) -> None:
        """Check the limits.

        Raises:
            InvalidParameterError: One of them is not a positive finite number.
        """
        for name in ("attempts", "tokens", "seconds"):
            value = getattr(self, name)
            if not math.isfinite(value) or value <= 0:
                raise InvalidParameterError(f"a budget of {value} {name}; it must be above 0")


class Budget:
    """A task's account."""

    def __init__(self, limits: BudgetLimits) -> None:
        """Begin with everything that ``limits`` allow."""
        self.limits = limits
        self.attempts = 0
        self.tokens = 0
        self.seconds = 0.0  # waited; from recorded figures in replay, so that it is the same again

    @property
    def spent(self) -> bool:
        """Whether nothing more may be asked."""
        return (
            self.attempts >= self.limits.attempts
            or self.tokens >= self.limits.tokens
            or self.seconds >= self.limits.seconds
        )

    @property
    def seconds_left(self) -> float:
        """How long the next answer may take, s."""
        return max(0.0, self.limits.seconds - self.seconds)

    def book(self, reply: Reply) -> None:
        """Count an answer."""
        self.attempts += 1
        self.tokens += reply.tokens
        self.seconds += reply.seconds

    def left(self) -> dict[str, int | float]:
        """What is left, for log lines."""
        return {
            "attempts": max(0, self.limits.attempts - self.attempts),
            "tokens": max(0, self.limits.tokens - self.tokens),
            "seconds": round(self.seconds_left, 3),
        }

    def __str__(self) -> str:
        return (
            f"{self.attempts} of {self.limits.attempts} attempts, {self.tokens} of "
            f"{self.limits.tokens} tokens, {self.seconds:.1f} of {self.limits.seconds:g} s"
        )
