# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A local page on which effects are tried by hand; `page` alone knows a web framework."""
