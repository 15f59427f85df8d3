# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Settings of Sphinx: `make docs` builds these pages into build/docs."""

from pathlib import Path
import re
import sys

from jinja2 import FileSystemLoader
from jinja2.sandbox import SandboxedEnvironment
from numpydoc import docscrape_sphinx

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

project = 'hysteresis_ros'
author = 'hysteresis_ros contributors'
copyright = f'2026, {author}'
release = re.search('<version>(.+)</version>',
                    (ROOT / 'package.xml').read_text(encoding='utf-8')).group(1)

extensions = ['sphinx.ext.autodoc', 'sphinx.ext.mathjax', 'myst_parser', 'numpydoc']
html_theme = 'alabaster'
html_theme_options = {'description': 'Hysteresis models for artificial muscles',
                      'page_width': '1100px'}
exclude_patterns = ['_build']

# The pages need neither ROS nor a serial port.
autodoc_mock_imports = [
    'ament_index_python', 'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs',
    'nicegui', 'rcl_interfaces', 'rclpy', 'rosbag2_py', 'rosgraph_msgs', 'sensor_msgs', 'serial',
    'starlette', 'std_msgs', 'std_srvs', 'trajectory_msgs', 'visualization_msgs']
autodoc_member_order = 'bysource'
autodoc_typehints = 'none'      # the docstrings give the types
numpydoc_class_members_toctree = False
numpydoc_show_class_members = False
# numpydoc reads and compiles its template anew for each docstring, a third of the time.
environment = SandboxedEnvironment(
    loader=FileSystemLoader(Path(docscrape_sphinx.__file__).parent / 'templates'))
docscrape_sphinx.SandboxedEnvironment = lambda **_: environment
# Anchors of headings, to which the README links.
myst_heading_anchors = 3


def take_readme(app, name, source):
    """Make the READMEs the pages `readme` and `firmware`, with their links as from this folder."""
    if name == 'readme':
        text = (ROOT / 'README.md').read_text(encoding='utf-8')
        text = text.replace('](firmware/README.md', '](firmware.md')
        text = re.sub(r'\[([^]]+)\]\(QUALITY_DECLARATION.md\)', r'\1', text)
        source[0] = re.sub(r'\]\(docs/', '](', re.sub(r'\]\((config/)', r'](../\1', text))
    elif name == 'firmware':
        text = (ROOT / 'firmware' / 'README.md').read_text(encoding='utf-8')
        source[0] = re.sub(r'\]\((wiring|hal)', r'](../firmware/\1',
                           text.replace('](../docs/', ']('))
    else:
        source[0] = source[0].replace('](../README.md', '](readme.md').replace(
            '](../firmware/README.md', '](firmware.md')


def setup(app):
    """Register what this file adds to Sphinx."""
    app.connect('source-read', take_readme)
