# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which tasks of its seed a training uses for what: no task has two uses."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError

END = 2**32  # messages have room for the indices below it


@dataclass(frozen=True)
class TaskRange:
    """The tasks of one use, numbered from 0.

    Args:
        use: Use of the tasks, in words.
        first: Index of the first task, among those of the seed.
        end: Index after the last task: the first of another use.
    """

    use: str
    first: int
    end: int = END

    def index(self, number: int) -> int:
        """The index of a task among those of the seed.

        Args:
            number: Number of the task in this range, from 0.

        Raises:
            InvalidParameterError: The range has no such task.
        """
        return self.batch(number, 1).start

    def batch(self, number: int, size: int) -> range:
        """The indices of one of several batches of the same size, which have no task in common.

        Args:
            number: Number of the batch, from 0.
            size: Number of tasks in each batch.

        Raises:
            InvalidParameterError: The range has not so many tasks.
        """
        begins = self.first + number * size
        if number < 0 or begins + size > self.end:
            raise InvalidParameterError(
                f"a training has {self.end - self.first} tasks for {self.use}, not {number + 1} "
                f"times {size}; choose settings with fewer"
            )
        return range(begins, begins + size)
