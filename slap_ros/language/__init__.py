# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Talking to a language model: requests, a client, cassettes, budgets, prompts, texts parsed.

Nothing that a model writes is executed or used as a template; what it may say is judged elsewhere
(``slap_ros.acquisition``).
"""
