# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables and figures of LG-SAIL: operators, rewards, and skills that are acquired."""
