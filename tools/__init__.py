# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What those who work on slap_ros use, and nobody else needs."""
