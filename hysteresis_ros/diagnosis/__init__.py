# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a model fails, which physical effect it is missing, and the model with that effect."""
