# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The virtual laboratory: physics of a shape memory bench and of the robotic bicep."""
