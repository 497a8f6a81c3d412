# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The part of rosidl_runtime_py that finds interface classes by name."""
