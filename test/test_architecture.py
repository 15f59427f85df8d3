# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Who may import whom, and what no file may do."""

import ast
import functools
import os
import re
import subprocess
import sys

import pytest

ROS = {'rclpy', 'ament_index_python', 'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs',
       'lifecycle_msgs', 'rcl_interfaces', 'rosbag2_py', 'rosgraph_msgs', 'rosidl_runtime_py',
       'sensor_msgs', 'std_msgs', 'std_srvs', 'trajectory_msgs', 'visualization_msgs'}
# rosbag2_py reads what rosbags does not know, and is asked for only then.
ROS_OUTSIDE_NODES = {'hysteresis_ros.measurements.bag_rosbag2'}
# What serves the page of `hysteresis studio`, and the two files that may know it.
WEB = {'nicegui', 'fastapi', 'starlette', 'uvicorn'}
WEB_PAGES = {'hysteresis_ros.studio.page', 'hysteresis_ros.studio.server'}
MODEL = {'operators', 'effects', 'model', 'identification', 'bicep'}
# What the simulated board and its host have to agree on: pure functions of bytes.
CODEC = ('hysteresis_ros.bridge.protocol', 'hysteresis_ros.bridge.messages')
UNSAFE_MODULES = {'pickle', 'cPickle', 'cloudpickle', 'dill', 'marshal', 'shelve'}
UNSAFE_CALLS = {'eval', 'exec', 'os.system', 'os.popen', 'joblib.load', 'joblib.dump',
                'yaml.load', 'yaml.load_all', 'yaml.unsafe_load', 'yaml.unsafe_load_all',
                'yaml.full_load', 'yaml.full_load_all'}


@functools.cache
def modules(root):
    """Return the package's modules: name to syntax tree and the parts of its package's name."""
    found = {}
    for path in sorted((root / 'hysteresis_ros').rglob('*.py')):
        parts = path.relative_to(root).with_suffix('').parts
        name = '.'.join(part for part in parts if part != '__init__')
        found[name] = ast.parse(path.read_text(encoding='utf-8'), filename=str(path)), parts[:-1]
    return found


def imports(tree, package=()):
    """Return the modules and names that a tree in a package imports, in full, with their lines."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[:len(package) - node.level + 1] if node.level else ()
            origin = '.'.join([*above, *filter(None, [node.module])])
            found += [(f'{origin}.{alias.name}', node.lineno) for alias in node.names]
    return found


def at_import(tree):
    """Return the nodes of a tree that run when the module is imported."""
    pending = list(tree.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.If) and dotted(node.test) == 'TYPE_CHECKING':
            pending += node.orelse
            continue
        yield node
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            pending += ast.iter_child_nodes(node)


def offenders(root, allowed, wrong):
    """Return 'module:line imports name' for each wrong import in modules not allowed it."""
    return [f'{module}:{line} imports {name}'
            for module, (tree, package) in modules(root).items() if not allowed(module)
            for name, line in imports(tree, package) if wrong(name)]


def test_ros_stays_in_the_nodes(root):
    """The core runs in a notebook on a machine without ROS."""
    assert offenders(
        root,
        lambda module: (module.startswith('hysteresis_ros.nodes')
                        or module in ROS_OUTSIDE_NODES),
        lambda name: name.split('.')[0] in ROS) == []


def test_the_web_framework_stays_in_the_page(root):
    """What the page shows and does is tested, and could be shown, without it."""
    assert offenders(root, lambda module: module in WEB_PAGES,
                     lambda name: name.split('.')[0] in WEB) == []


def test_only_its_command_knows_the_studio(root):
    """No command needs the page of another one."""
    assert offenders(
        root, lambda module: module.startswith(('hysteresis_ros.studio',
                                                'hysteresis_ros.cli.studio')),
        lambda name: name.startswith('hysteresis_ros.studio')) == []


def test_identification_does_not_know_the_diagnosis(root):
    """What the bench gives comes first."""
    assert offenders(root, lambda module: not module.startswith('hysteresis_ros.identification'),
                     lambda name: name.startswith('hysteresis_ros.diagnosis')) == []


def test_the_serial_port_stays_in_the_bridge(root):
    """One place speaks to boards."""
    assert offenders(
        root,
        lambda module: module.startswith('hysteresis_ros.bridge'),
        lambda name: name.split('.')[0] == 'serial') == []


def test_the_laboratory_does_not_know_the_model(root):
    """A laboratory that shared code with the model would prove nothing about it."""
    assert offenders(
        root,
        lambda module: not module.startswith('hysteresis_ros.laboratory'),
        lambda name: name.split('.')[0] == 'hysteresis_ros' and name.split('.')[1] in MODEL) == []


def test_the_simulated_board_shares_only_the_codec_with_the_bridge(root):
    """The laboratory's board is the other end of the cable, not a part of the host."""
    assert offenders(
        root,
        lambda module: not module.startswith('hysteresis_ros.laboratory'),
        lambda name: name.startswith(('hysteresis_ros.bridge', 'hysteresis_ros.nodes'))
        and not name.startswith(CODEC)) == []
    assert offenders(
        root,
        lambda module: (not module.startswith('hysteresis_ros.laboratory')
                        or module.startswith('hysteresis_ros.laboratory.board')),
        lambda name: name.startswith('hysteresis_ros.bridge')) == []


def test_only_the_port_handler_brings_the_laboratory_into_the_bridge(root):
    """A host on a real board needs no virtual laboratory; `sim://` is what asks for it."""
    assert offenders(
        root,
        lambda module: (not module.startswith('hysteresis_ros.bridge')
                        or module.startswith('hysteresis_ros.bridge.urlhandlers')),
        lambda name: name.startswith('hysteresis_ros.laboratory')
        and name != 'hysteresis_ros.laboratory.board.url.check_url') == []


def test_the_codec_is_pure(root):
    """The frames of the board's protocol are bytes and numbers, for the host and the board."""
    assert offenders(
        root, lambda module: module not in CODEC,
        lambda name: (name.split('.')[0] not in sys.stdlib_module_names
                      and not name.startswith((*CODEC, 'hysteresis_ros.errors')))) == []


def test_the_model_does_not_know_the_laboratory(root):
    """Nor may the model look at the plant that it is judged on."""
    assert offenders(
        root,
        lambda module: module.split('.')[1:2] and module.split('.')[1] not in MODEL,
        lambda name: name.startswith('hysteresis_ros.laboratory')) == []


def test_plots_cost_nothing_until_drawn(root):
    """matplotlib takes a second to import: only a function that draws does so."""
    for module, (tree, _) in modules(root).items():
        for node in at_import(tree):
            names = [alias.name for alias in getattr(node, 'names', [])
                     if isinstance(node, ast.Import)]
            if isinstance(node, ast.ImportFrom):
                names = [node.module or '']
            assert not any(name.split('.')[0] == 'matplotlib' for name in names), module


def test_the_core_imports_without_ros_serial_and_web(root):
    """Import every module outside nodes and bridge where none of them is to be had."""
    names = [module for module in modules(root)
             if module.split('.')[1:2] not in (['nodes'], ['bridge'])
             and module not in ROS_OUTSIDE_NODES | {'hysteresis_ros.studio.page'}
             and not module.endswith('__main__')]
    code = f"""
import importlib, sys

class Nothing:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] in {sorted(ROS | WEB | {'serial'})!r}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Nothing())
for name in {names!r}:
    importlib.import_module(name)
assert 'matplotlib' not in sys.modules
"""
    done = subprocess.run([sys.executable, '-c', code], cwd=root, capture_output=True, text=True,
                          env={**os.environ, 'PYTHONPATH': str(root)}, check=False)
    assert done.returncode == 0, done.stderr


def dotted(node):
    """Return the dotted name of an expression, or '' where it has none."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return f'{dotted(node.value)}.{node.attr}'
    return ''


def all_trees(root):
    """Return the syntax trees of all that runs for a user, with their paths."""
    paths = [path for folder in ('hysteresis_ros', 'launch', 'tools', 'benchmark')
             for path in sorted((root / folder).rglob('*.py'))]
    return [(path.relative_to(root), ast.parse(path.read_text(encoding='utf-8')))
            for path in paths]


def test_no_file_of_a_stranger_is_executed(root):
    """No pickle, eval, shell or unsafe YAML: models and measurements come from anywhere."""
    found = []
    for path, tree in all_trees(root):
        found += [f'{path}:{line} imports {name}' for name, line in imports(tree)
                  if name.split('.')[0] in UNSAFE_MODULES or name in UNSAFE_CALLS]
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                risky = dotted(node.func) in UNSAFE_CALLS or any(
                    keyword.arg in ('shell', 'allow_pickle')
                    and getattr(keyword.value, 'value', True) is not False
                    for keyword in node.keywords)
                if risky and not safe_yaml(node, tree):
                    found.append(f'{path}:{node.lineno} calls {dotted(node.func)}')
    assert found == []


def safe_yaml(call, tree):
    """Return whether a call is `yaml.load` with a safe loader, the fast one from C included."""
    if dotted(call.func) not in ('yaml.load', 'yaml.load_all'):
        return False
    loaders = [*call.args[1:2], *(word.value for word in call.keywords if word.arg == 'Loader')]
    for name in [loader.id for loader in loaders if isinstance(loader, ast.Name)]:
        loaders += [node.value for node in ast.walk(tree) if isinstance(node, ast.Assign)
                    and name in map(dotted, node.targets)]
    kinds = re.findall(r'(Safe)?Loader', ' '.join(map(ast.unparse, loaders)))
    return bool(kinds) and all(kinds)


def text_files(root):
    """Return the files of the project that hold text, without what make made."""
    made = re.compile(r'\.(git|venv.*|workspace.*|pytest_cache|hypothesis|coverage.*)$'
                      r'|(build|install|log|dist|demo|__pycache__)$|.*\.egg-info$')
    for folder, folders, files in os.walk(root):
        folders[:] = [name for name in folders if not made.match(name)]
        for name in files:
            path = os.path.join(folder, name)
            if made.match(name) or name in ('benchmark.json', 'hidden.json'):
                continue
            with open(path, 'rb') as file:
                content = file.read()
            if b'\0' not in content:
                yield path, content.decode('utf-8')


def test_no_file_depends_on_the_machine_it_was_written_on(root):
    """No path of somebody's home or working folder."""
    private = re.compile(r'(?:^|[^\w.])/(?:' + '|'.join(['home', 'root', 'work', 'tmp', 'Users'])
                         + r')/\w')
    found = [f'{os.path.relpath(path, root)}: {match.group().strip()}'
             for path, text in text_files(root) for match in private.finditer(text)]
    assert found == []


@pytest.mark.parametrize('code, safe', [
    ('yaml.load(text, Loader=yaml.SafeLoader)', True),
    ('yaml.load(text, yaml.CSafeLoader)', True),
    ("loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)\nyaml.load(text, loader)", True),
    ('yaml.load(text)', False),
    ('yaml.load(text, Loader=yaml.Loader)', False),
    ("loader = getattr(yaml, 'CLoader', yaml.SafeLoader)\nyaml.load(text, loader)", False)])
def test_safe_yaml_is_told_from_unsafe(code, safe):
    """The check of this file sees what it is to see."""
    tree = ast.parse(code)
    assert safe_yaml(tree.body[-1].value, tree) is safe
