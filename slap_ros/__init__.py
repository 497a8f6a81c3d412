# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""slap_ros: abstract planning with learned shortcuts. The core; it imports no ROS.

::

    import slap_ros

    domain = slap_ros.make("obstacle_tower", obstacles=4)
    task = domain.task(seed=1)
    plan = slap_ros.plan(domain, task)
    run = slap_ros.execute(domain, task, plan)
    print(plan, run.steps, slap_ros.plan(domain, task, shortcuts=None).steps)

Importing the package imports nothing else: each function comes with what it needs when it is first
used.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as type checkers know it; to import typing would take most of the time
if TYPE_CHECKING:
    from slap_ros.api.acquisition import acquire
    from slap_ros.api.evaluation import evaluate
    from slap_ros.api.execution import execute
    from slap_ros.api.opening import domains, make
    from slap_ros.api.planning import plan
    from slap_ros.api.proposing import propose
    from slap_ros.api.recording import load_bag
    from slap_ros.api.training import train

__version__ = "0.2.0"
__all__ = [
    "acquire",
    "domains",
    "evaluate",
    "execute",
    "load_bag",
    "make",
    "plan",
    "propose",
    "train",
]
_MODULES = {
    "acquire": "slap_ros.api.acquisition",
    "domains": "slap_ros.domains",  # a package that can be called: see there
    "evaluate": "slap_ros.api.evaluation",
    "execute": "slap_ros.api.execution",
    "load_bag": "slap_ros.api.recording",
    "make": "slap_ros.api.opening",
    "plan": "slap_ros.api.planning",
    "propose": "slap_ros.api.proposing",
    "train": "slap_ros.api.training",
}


def __getattr__(name: str) -> object:
    """A public name, imported when it is first used (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = import_module(_MODULES[name])
    return module if module.__name__ == f"{__name__}.{name}" else getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
