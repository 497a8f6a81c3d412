# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The domains, one folder each, and the registry that finds them.

``slap_ros.domains()`` gives the names of all that are installed, ours first. This package has the
name of that function, and Python binds the name to the package once anything imports it. So the
package itself can be called.
"""

import sys
from types import ModuleType

from slap_ros.domains.registry import domain_names, forget_domains, get_domain, preset_names

__all__ = ["domain_names", "forget_domains", "get_domain", "preset_names"]


class _CallablePackage(ModuleType):
    """A package that is a function as well."""

    def __call__(self) -> list[str]:
        """See :func:`slap_ros.api.opening.domains`."""
        return domain_names()


sys.modules[__name__].__class__ = _CallablePackage
