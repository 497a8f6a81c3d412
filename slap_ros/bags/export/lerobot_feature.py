# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A feature of LeRobot's frames: its description, its column, its statistics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pyarrow

QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


@dataclass(frozen=True)
class LeRobotFeature:
    """A feature of every frame.

    Args:
        dtype: Type of its numbers, as numpy names it; or string.
        names: Names of its numbers; None for a single one.
        values: One row per frame, shape (frames, len(names)), or (frames,) for a single one.
    """

    dtype: str
    names: tuple[str, ...] | None
    values: NDArray[Any]

    @property
    def size(self) -> int:
        """How many numbers a frame has of it."""
        return 1 if self.names is None else len(self.names)

    def as_json(self) -> dict[str, Any]:
        """The feature as ``info.json`` describes it."""
        names = None if self.names is None else list(self.names)
        return {"dtype": self.dtype, "shape": [self.size], "names": names}

    def column(self) -> pyarrow.Array:
        """Its values; a feature of one number is stored without a list around it."""
        import pyarrow

        flat = pyarrow.array(self.values.reshape(-1).astype(_numpy_type(self.dtype)))
        return flat if self.size == 1 else pyarrow.FixedSizeListArray.from_arrays(flat, self.size)

    def rows(self, start: int, end: int) -> LeRobotFeature:
        """The same of some frames."""
        return LeRobotFeature(self.dtype, self.names, self.values[start:end])

    def statistics(self) -> dict[str, list[float]]:
        """Least, greatest and mean value, standard deviation, count and quantiles."""
        values = self.values.reshape(len(self.values), -1).astype(_numpy_type(self.dtype))
        values = values.astype(np.float64)
        return {
            "min": values.min(axis=0).tolist(),
            "max": values.max(axis=0).tolist(),
            "mean": values.mean(axis=0).tolist(),
            "std": values.std(axis=0).tolist(),
            "count": [len(values)],
        } | {name: np.quantile(values, q, axis=0).tolist() for name, q in QUANTILES.items()}


def _numpy_type(dtype: str) -> str:
    return "str" if dtype == "string" else dtype
