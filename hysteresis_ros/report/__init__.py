# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Comparison, diagnosis and extension in words, pictures and self-contained pages."""
