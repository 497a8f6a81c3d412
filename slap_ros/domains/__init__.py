# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The domains, one folder each, and the registry that finds them."""

from slap_ros.domains.registry import domain_names, forget_domains, get_domain, preset_names

__all__ = ["domain_names", "forget_domains", "get_domain", "preset_names"]
