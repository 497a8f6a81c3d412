# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Determinants beside exact ones, and on other processors."""

import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest

from slap_ros.meshes.determinants import determinants

DIGEST = """
from slap_ros.domains.cleanup_table.shapes import shipped
print([(s.inertia, s.points.tolist(), [c.half for c in s.cores]) for s in shipped().values()])
"""


def exact(rows):
    (a, b, c), (d, e, f), (g, h, i) = [[Fraction(value) for value in row] for row in rows]
    return float(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))


def test_they_are_exact_but_for_rounding():
    matrices = np.random.default_rng(0).normal(size=(200, 3, 3))
    wanted = [exact(rows) for rows in matrices.tolist()]
    assert determinants(matrices) == pytest.approx(wanted, rel=1e-12, abs=1e-14)


def test_rows_may_change_places_and_depend_on_each_other():
    assert determinants(np.eye(3)[[1, 0, 2]]) == -1.0
    assert determinants(np.eye(3)[[1, 2, 0]]) == 1.0
    assert determinants(np.ones((2, 3, 3))).tolist() == [0.0, 0.0]


# Those of this processor, whichever they are, beside those of one without AVX.
@pytest.mark.parametrize("kernels", [{}, {"OPENBLAS_CORETYPE": "Haswell"}], ids=["own", "haswell"])
def test_toys_are_the_same_with_all_kernels_of_openblas(kernels):
    assert toys(kernels) == toys({"OPENBLAS_CORETYPE": "Prescott"})


def toys(environment):
    command = (sys.executable, "-c", DIGEST)
    made = subprocess.run(command, env=os.environ | environment, capture_output=True, check=True)
    return made.stdout
