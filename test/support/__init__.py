# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What tests share: scenes, domains, servers, faults, and programs that they start."""
