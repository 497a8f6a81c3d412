# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL text out and in.

Read in this order: ``tokens.py``, ``sexpr.py`` and ``sections.py`` cut a text into its parts;
``types.py``, ``conditions.py`` and ``effects.py`` say what the parts mean; ``domain_reader.py`` and
``problem_reader.py`` put them together. ``bindings.py`` and ``grounder.py`` make the ground task
that is planned with (``ground_task.py``).
"""

from slap_ros.relational.pddl.domain_reader import parse_domain
from slap_ros.relational.pddl.problem_reader import parse_goal, parse_problem
from slap_ros.relational.pddl.task import PddlDomain, PddlProblem
from slap_ros.relational.pddl.writer import with_different_objects, write_domain, write_problem

__all__ = [
    "PddlDomain",
    "PddlProblem",
    "parse_domain",
    "parse_goal",
    "parse_problem",
    "with_different_objects",
    "write_domain",
    "write_problem",
]
