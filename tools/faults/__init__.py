# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Every fault of docs/safety.md, injected into a heated arm; see `__main__`."""
