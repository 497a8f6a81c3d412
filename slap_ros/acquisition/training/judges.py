# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The judges of checkpoints: this process, or another one, so that this one can learn on.

The verdicts are the same, since each trial is a function of its state and the policy.
"""

from __future__ import annotations

from multiprocessing.connection import Connection
from typing import Protocol

from slap_ros.acquisition.training.validation import SkillTrials
from slap_ros.learning.linked_process import receive, send
from slap_ros.policies.mlp_policy import MlpPolicy


class Judge(Protocol):
    """Judges one policy at a time."""

    def begin(self, policy: MlpPolicy) -> None:
        """Begin to judge a policy.

        Args:
            policy: Policy to judge, whose weights do not change any more.
        """
        ...

    def verdict(self) -> float:
        """Wait for the success of the policy that was begun with.

        Raises:
            ChildProcessError: The process that judged has ended.
        """
        ...

    def core_to_spare(self) -> bool:
        """Whether a second core has nothing to judge just now."""
        ...


class JudgeHere:
    """Judges in this process, when the verdict is asked for."""

    def __init__(self, trials: SkillTrials) -> None:
        self._trials = trials

    def begin(self, policy: MlpPolicy) -> None:
        """See :class:`Judge`."""
        self._policy = policy

    def verdict(self) -> float:
        """See :class:`Judge`."""
        return self._trials.success(self._policy.mean)

    def core_to_spare(self) -> bool:
        """See :class:`Judge`: the only core is this process's own."""
        return False


class JudgeElsewhere:
    """Lets the process at the other end of a link judge, which runs :func:`judge_until_closed`."""

    def __init__(self, link: Connection) -> None:
        self._link, self._asked = link, False

    def begin(self, policy: MlpPolicy) -> None:
        """See :class:`Judge`."""
        self._asked = True
        send(self._link, policy)

    def verdict(self) -> float:
        """See :class:`Judge`."""
        success = float(receive(self._link))
        self._asked = False
        return success

    def core_to_spare(self) -> bool:
        """See :class:`Judge`."""
        return not self._asked or self._link.poll()


def judge_until_closed(link: Connection, trials: SkillTrials) -> None:
    """Judge policies that arrive by a link, until its other end is closed."""
    while True:
        policy: MlpPolicy = link.recv()
        link.send(trials.success(policy.mean))
