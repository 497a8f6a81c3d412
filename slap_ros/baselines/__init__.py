# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What SLAP and LG-SAIL are compared with: learners of whole tasks, and others of shortcuts.

Each method has a file: ``ppo.py``, ``sac.py``, ``curriculum.py``, ``maple.py``,
``sac_her.py``, ``hierarchical.py``, ``sol.py``; ``methods.py`` lists them. All learn on
the environments of :mod:`slap_ros.environments`, as anybody else's learner would.
``training.py`` is one training, ``trained_baseline.py`` what comes of it on disk, and ``trials.py``
how it is tried on the tasks of an evaluation.
"""
