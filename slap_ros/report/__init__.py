# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A page about a run, or one that compares several, made from their bags alone."""

from slap_ros.report.content import BagReport, RunReport, read_report
from slap_ros.report.page import check_output, render, write_page

__all__ = ["BagReport", "RunReport", "check_output", "read_report", "render", "write_page"]
