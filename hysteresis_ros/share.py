# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where the files are that come with the package: parameters, the identified model, launch files.

They are found from where this file lies, in a checkout as in an installed prefix, so that neither
the command line nor a node needs an ament environment for it.
"""

from pathlib import Path

from hysteresis_ros.errors import ParameterError

PACKAGE = 'hysteresis_ros'


def share_path(name: str) -> Path:
    """
    Return the path of a file of the package's share directory.

    Parameters
    ----------
    name : str
        Path below the share directory, such as ``config/bicep.yaml``.

    Raises
    ------
    ParameterError
        If the package was installed without it.
    """
    here = Path(__file__).resolve()
    roots = [here.parents[1], *(parent / 'share' / PACKAGE for parent in here.parents)]
    for root in roots:
        if (root / name).exists():
            return root / name
    raise ParameterError(f'{name} did not come with this installation of {PACKAGE}; '
                         'build it with colcon, or give the file')
