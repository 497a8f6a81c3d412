# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The domains as Gymnasium environments: whole tasks, shortcuts and skills, for any learner.

Read ``task_env.py`` first; then what it is put together from: ``slots.py`` and ``observations.py``
(what is seen), ``task_rewards.py``, ``controls.py`` (what an action is). ``shortcut_env.py`` and
``skill_env.py`` are what our own learners learn in, by ``mdp_env.py``. ``registration.py`` gives
``gymnasium.make`` their names.

Importing the package registers them, and imports no domain and no learner.
"""

from slap_ros.environments.registration import register

register()
