# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Print what setup.py requires, with the extras named: `requirements.py test,bags`."""

from distutils.core import run_setup  # from setuptools, where Python no longer has it
import sys


def requirements(extras):
    """
    Return the requirements of setup.py.

    Parameters
    ----------
    extras : list of str
        Names in `extras_require`; a KeyError names one that is not there.

    Returns
    -------
    list of str
        Requirements without spaces, in the order of setup.py.
    """
    package = run_setup('setup.py', stop_after='init')
    names = list(package.install_requires)
    for extra in extras:
        names += package.extras_require[extra]
    return [''.join(name.split()) for name in names]


if __name__ == '__main__':
    print('\n'.join(requirements(sys.argv[1].split(','))))
