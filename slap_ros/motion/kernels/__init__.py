# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion as machine code, by numba: one file per function of the numpy code, the same to the bit.

Read :mod:`slap_ros.compilation` first, then ``kinematics.py``, ``separation.py`` and
``collision.py``; what is built on them follows. ``compiled_backend.py`` is the door.
"""
