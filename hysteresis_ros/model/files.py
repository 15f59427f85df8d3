# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The model file: one YAML mapping, read by safe load only."""

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hysteresis_ros.atomic import write_text
from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.effects import (
    catalogue, Effect, effect_class, package_of, Surroundings)
from hysteresis_ros.errors import HysteresisError, ModelFileError
from hysteresis_ros.model.linear import LinearModel
from hysteresis_ros.model.muscle import MuscleModel
from hysteresis_ros.model.replicates import Replicate
from hysteresis_ros.operators import HysteresisOperator, operator_from_dict

SCHEMA = 1
# No model comes near these; a file that does is no model, and could bring the parser down.
LARGEST_FILE = 20_000_000
DEEPEST_NESTING = 40
TABLES = ('.csv', '.tsv')


def to_dict(model: MuscleModel) -> dict[str, Any]:
    """Return the model as plain types, in the order in which a person reads it."""
    return _plain({
        'schema': SCHEMA, 'kind': model.kind,
        'drive': model.drive, 'load': model.load_name, 'response': model.response,
        'sign': model.sign, 'mean_load': float(model.mean_load),
        'metrics': model.metrics,
        'effects': [_effect_entry(effect) for effect in model.effects],
        'geometry': model.geometry.to_mapping() if model.geometry else None,
        'ranges': {name: [float(low), float(high)]
                   for name, (low, high) in model.ranges.items()},
        'linear': model.linear.to_dict() if model.linear else None,
        'force_stage': model.force_stage.to_dict() if model.force_stage else None,
        'length_stage': model.length_stage.to_dict() if model.length_stage else None,
        'replicates': [{
            'effects': [_effect_entry(effect) for effect in replicate.effects],
            'length_stage': replicate.length_stage.to_dict()} for replicate in model.replicates],
        'provenance': model.provenance,
    })


def _plain(value: Any) -> Any:
    """Return a copy of plain types: no NumPy numbers, no tuples, nothing shared."""
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value


def save(model: MuscleModel, path: str | os.PathLike[str]) -> None:
    """
    Write the model; an existing file is replaced only by a complete one.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    write_text(path, '# Model of a muscle with hysteresis, written by hysteresis_ros.\n'
               + yaml.safe_dump(to_dict(model), sort_keys=False, default_flow_style=None,
                                width=100))


def load(path: str | os.PathLike[str]) -> MuscleModel:
    """
    Read a model file.

    Raises
    ------
    ModelFileError
        If it is no model file, is damaged, or is of another schema version.
    OSError
        If it cannot be read.
    """
    if Path(path).stat().st_size > LARGEST_FILE:
        raise ModelFileError(f'{path}: not a model file, it is larger than '
                             f'{LARGEST_FILE // 1_000_000} MB')
    table = _first_line(path)
    if Path(path).suffix.lower() in TABLES:
        raise ModelFileError(f'{path}: a table ({table[:60]!r}), no model file; give it as data. '
                             '`hysteresis identify` makes a model of bench tables')
    try:
        content = _parse(Path(path).read_text(encoding='utf-8'))
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        first = ' '.join(str(error).split())
        raise ModelFileError(f'{path}: not a model file ({first[:120]})') from None
    if not isinstance(content, Mapping) or 'schema' not in content:
        is_geometry = isinstance(content, Mapping) and {'clamp_distance', '/**'} & set(content)
        raise ModelFileError(f'{path}: {"the geometry of an arm, " if is_geometry else ""}not a '
                             'model file; `hysteresis identify` writes one')
    if content['schema'] != SCHEMA:
        raise ModelFileError(f'{path}: model file of schema {content["schema"]!r}, this version '
                             f'reads {SCHEMA}; identify the model again')
    try:
        return from_dict(content)
    except KeyError as error:
        raise ModelFileError(f'{path}: the model file lacks {error}') from None
    except HysteresisError as error:
        raise ModelFileError(f'{path}: {error}') from None
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        first = ' '.join(str(error).split())
        raise ModelFileError(f'{path}: damaged model file ({first[:120]})') from None


def _first_line(path: str | os.PathLike[str]) -> str:
    with open(path, encoding='utf-8', errors='replace') as file:
        return file.readline(1000).strip()


def _parse(text: str) -> Any:
    """Return the content of YAML text, by safe load only."""
    loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
    depth = 0
    # The fast parser builds nested values by recursion in C, without a limit of its own.
    for event in yaml.parse(text, Loader=loader):
        if isinstance(event, yaml.AliasEvent):
            raise ValueError('it has references, which no model file has')
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST_NESTING:
            raise ValueError('it is nested too deeply')
    return yaml.load(text, Loader=loader)


def from_dict(content: Mapping[str, Any]) -> MuscleModel:
    """
    Build the model from what `to_dict` returned.

    Raises
    ------
    HysteresisError, KeyError, TypeError, ValueError
        If a part is missing or makes no sense; `load` makes one kind of error of them.
    """
    ranges = {str(name): (_number(low, name), _number(high, name))
              for name, (low, high) in content['ranges'].items()}
    if isinstance(content['sign'], bool) or content['sign'] not in (-1, 1):
        raise ModelFileError(f'sign must be -1 or 1, not {content["sign"]!r}')
    model = MuscleModel(
        kind=str(content['kind']), drive=str(content['drive']),
        load_name=None if content['load'] is None else str(content['load']),
        response=str(content['response']),
        length_stage=_operator(content['length_stage']),
        force_stage=_operator(content['force_stage']),
        sign=int(content['sign']),
        linear=LinearModel.from_dict(content['linear']) if content['linear'] else None,
        geometry=(BicepGeometry.from_mapping(content['geometry'], 'model file')
                  if content['geometry'] else None),
        ranges=ranges, mean_load=_number(content['mean_load'], 'mean_load'),
        metrics=dict(content['metrics']), provenance=dict(content['provenance']))
    model.effects = _effects(content, model)
    # Files of before have none.
    model.replicates = [
        Replicate(operator_from_dict(entry['length_stage']), _effects(entry, model))
        for entry in content.get('replicates', [])]
    return model


def _effects(content: Mapping[str, Any], model: MuscleModel) -> list[Effect]:
    return [_effect(entry, model.surroundings) for entry in content['effects']]


def _operator(content: Mapping[str, Any] | None) -> HysteresisOperator | None:
    return None if content is None else operator_from_dict(content)


def _effect_entry(effect: Effect) -> dict[str, Any]:
    """Return an effect as plain types, with the package that a user has to have for it."""
    package = package_of(type(effect))
    return {**effect.to_dict(), **({'package': package} if package else {})}


def _effect(entry: Mapping[str, Any], surroundings: Surroundings) -> Effect:
    parameters = entry['parameters']
    if entry['id'] not in catalogue() and entry.get('package'):
        raise ModelFileError(
            f'the effect {entry["id"]!r} comes from the Python package {entry["package"]}, which '
            f'is not installed; install it (pip install {entry["package"]})')
    effect = effect_class(entry['id'])(surroundings, **{
        name: _number(parameter['value'], name) for name, parameter in parameters.items()})
    effect.intervals = {name: (_limit(parameter['low'], name), _limit(parameter['high'], name))
                        for name, parameter in parameters.items()}
    return effect


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ModelFileError(f'{name} is {value!r}, it has to be a finite number')
    return float(value)


def _limit(value: Any, name: str) -> float:
    """End of an interval: data that say nothing leave it open."""
    if isinstance(value, float) and math.isinf(value):
        return value
    return _number(value, f'interval of {name}')
