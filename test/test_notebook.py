# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The notebook of docs/ runs from its first cell to its last, as Jupyter would run it."""

import ast
import json
import re

import numpy as np
import pytest

import hysteresis_ros as hr

# What `--effects auto` finds on a bench, which has a test of its own.
EFFECTS = 'stress_dependence', 'stress_dependent_strain', 'series_compliance'


@pytest.fixture(scope='module')
def notebook(root):
    """Return the notebook's content."""
    return json.loads((root / 'docs' / 'notebook.ipynb').read_text(encoding='utf-8'))


def code_cells(notebook):
    """Return the code of each cell, by the cell's name."""
    return {cell['id']: ''.join(cell['source']) for cell in notebook['cells']
            if cell['cell_type'] == 'code'}


def run_cell(code, names):
    """Run a cell and return the value of its last line, which Jupyter shows."""
    body = ast.parse(code).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    exec(compile(ast.Module(body, []), 'cell', 'exec'), names)
    return last and eval(compile(ast.Expression(last.value), 'cell', 'eval'), names)


@pytest.mark.slow
def test_the_notebook_goes_from_the_bench_to_the_extended_model(notebook, tmp_path, monkeypatch):
    """Every cell runs, and shows a table or a picture where it ends in a result."""
    monkeypatch.chdir(tmp_path)
    names, shown = {}, {}
    for name, code in code_cells(notebook).items():
        shown[name] = run_cell(code.replace("'auto'", repr(EFFECTS)), names)
    assert names['diagnosis'].missing == ['payload_error']
    extended, test = names['extended'], names['test']
    assert extended.test['rmse_after'] < 0.3 * extended.test['rmse_before']
    rmse = np.sqrt(np.mean((names['angle'] - test.column('angle')) ** 2))
    assert rmse == pytest.approx(extended.test['rmse_after'])
    assert shown['predict'].model.rmse == pytest.approx(rmse, rel=1e-6)
    for name in ('identify', 'compare', 'diagnose', 'extend'):
        assert '<table' in shown[name]._repr_html_(), name
        assert shown[f'{name}-plot']._repr_png_().startswith(b'\x89PNG'), name


def test_the_notebook_uses_all_functions_and_holds_no_output(notebook):
    """Whole, small, and without what somebody's machine once printed."""
    code = '\n'.join(code_cells(notebook).values())
    assert set(re.findall(r'\bhr\.(\w+)\(', code)) == set(hr.__all__)
    cells = notebook['cells']
    assert (notebook['nbformat'], notebook['nbformat_minor']) == (4, 5)
    assert len({cell['id'] for cell in cells}) == len(cells)
    for cell in cells:
        assert re.fullmatch(r'[\w-]{1,64}', cell['id'])
        if cell['cell_type'] == 'code':
            assert cell['outputs'] == [] and cell['execution_count'] is None


def test_the_code_of_the_readme_is_that_of_the_notebook(notebook, root):
    """What runs in the one is true of the other: same calls, same arguments."""
    readme = (root / 'README.md').read_text(encoding='utf-8')
    block, = (block for block in re.findall(r'^```python\n(.*?)^```', readme, re.M | re.S)
              if 'import hysteresis_ros as hr' in block)

    def calls(code):
        return {ast.unparse(node) for node in ast.walk(ast.parse(code))
                if isinstance(node, ast.Call)}
    cells = calls('\n'.join(code_cells(notebook).values()))
    # There the picture is drawn from the comparison by its name.
    said = calls(block.replace('hr.compare(model, train).plot', 'comparison.plot'))
    assert said - cells == set()
