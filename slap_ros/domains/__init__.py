# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The domains, one folder each, and the registry that finds them."""

from slap_ros.domains.registry import PRESETS, domain_names, get_domain

__all__ = ["PRESETS", "domain_names", "get_domain"]
