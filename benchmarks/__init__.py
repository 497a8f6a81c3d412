# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measurements. Each prints ratios or figures taken side by side in one run."""
