# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The interface for notebooks and scripts: what the command line does, as seven functions.

`import hysteresis_ros as hr` has them by name. Where a measurement is expected, a path (a CSV file
or a rosbag2 folder), a `Measurement` or a table of columns (a dict of arrays, a pandas DataFrame)
will do, alone or several in a list; where a model is expected, a path, a `MuscleModel` or the
result that holds one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import dataclasses
import os
from typing import overload, Protocol, TYPE_CHECKING, TypeVar, Union

from hysteresis_ros.errors import MeasurementError, ParameterError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.comparison.compare import Comparison
    from hysteresis_ros.diagnosis.extend import Extension
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.identification.bench import Identified
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

__all__ = ['compare', 'diagnose', 'extend', 'identify', 'load_model', 'predict', 'read']

Item = TypeVar('Item')
AnyPath = Union[str, 'os.PathLike[str]']
# One measurement, and one or several.
Source = Union[AnyPath, 'Measurement', 'Mapping[str, ArrayLike]']
Sources = Union[Source, 'Sequence[Source]']
Model = Union[AnyPath, 'MuscleModel', 'Identified', 'Extension']
Geometry = Union[AnyPath, 'BicepGeometry', 'Mapping[str, float]']
# What bench tables measure, by the argument that takes them.
BENCH_RESPONSES = {'force': ('force',), 'length': ('length', 'strain')}


class Progress(Protocol):
    """Wraps the items of a long computation, as a progress bar does."""

    def __call__(self, items: Iterable[Item], total: int) -> Iterable[Item]:
        """Return the items; `total` is their number."""


def load_model(path: AnyPath) -> MuscleModel:
    """
    Read a model file.

    Parameters
    ----------
    path : str or Path
        As `hysteresis identify` or `MuscleModel.save` writes it.

    Returns
    -------
    MuscleModel

    Raises
    ------
    ModelFileError
        If it is no model file, is damaged, or is of another schema version.
    OSError
        If it cannot be read.

    """
    from hysteresis_ros.model import MuscleModel
    return MuscleModel.load(path)


@overload
def read(path: AnyPath, /, *, namespace: str | None = None,
         settled: bool = False, columns: str = '',
         settled_time: float | None = None) -> Measurement: ...


@overload
def read(path: AnyPath, second: AnyPath, /, *more: AnyPath, namespace: str | None = None,
         settled: bool = False, columns: str = '',
         settled_time: float | None = None) -> list[Measurement]: ...


def read(*paths: AnyPath, namespace: str | None = None,
         settled: bool = False, columns: str = '',
         settled_time: float | None = None) -> Measurement | list[Measurement]:
    """
    Read measurements: CSV files or rosbag2 recordings.

    Parameters
    ----------
    *paths : str or Path
        CSV files, rosbag2 folders (mcap or sqlite3), or their storage files.
    namespace : str, optional
        Which arm to take from a bag that recorded several.
    settled : bool
        Of a continuous run take only the ends of its holds.
    columns : str
        What the columns of tables mean, as ``--columns``: ``'angle=theta:deg,time=t_ms'``.
    settled_time : float, optional
        Time [s] for which the drive has to be held until muscle and arm have settled, 20 s by
        default. Rows of a table that are so far apart are settled states.

    Returns
    -------
    Measurement or list of Measurement
        One for one path, a list for several. Columns are in SI units, temperatures in degrees
        Celsius.

    Raises
    ------
    MeasurementError
        If one is missing, is no measurement, or has no settled states.

    """
    from hysteresis_ros.measurements import read_measurement, SETTLED_HOLD
    if not paths:
        raise MeasurementError('no measurement was given; name CSV files or bag folders')
    found = [read_measurement(path, namespace, settled, columns,
                              settled_time=SETTLED_HOLD if settled_time is None else settled_time)
             for path in paths]
    return found[0] if len(found) == 1 else found


def identify(length: Source | None = None, force: Source | None = None, *,
             force_trials: Sequence[float] | None = None,
             length_trials: Sequence[float] | None = None,
             geometry: Geometry | None = None, levels: tuple[int, int] = (10, 20),
             operator: str | None = None, anchored: bool = False,
             effects: str | Sequence[str] | None = None, jobs: int = -1,
             progress: Progress | None = None) -> Identified:
    """
    Identify a model of a muscle from bench tables.

    Parameters
    ----------
    length : path, Measurement or mapping, optional
        Drive, load [N] where there is one, and length [m] or strain.
    force : path, Measurement or mapping, optional
        Drive and force [N] at resting length.
    force_trials, length_trials : sequence of float, optional
        Trials to fit; the others verify. Default: all are fitted.
    geometry : path, mapping or BicepGeometry, optional
        The arm that the muscle will move.
    levels : (int, int)
        Levels of H1 and of H2.
    operator : {'two-stage', 'preisach', 'play', 'bouc-wen', 'linear'}, optional
        Default: two-stage with a force table, preisach without a load, else what predicts
        held-out trials better.
    anchored : bool
        Whether H1(0) is tied to the pretension and H2(0) to zero.
    effects : 'auto', str or sequence of str, optional
        Effects of the catalogue to add: those that the tables prove ('auto'), or those named.
        Default: none, the paper's model.
    jobs : int
        Processes for the search of effects; -1 for one on each core.
    progress : callable, optional
        ``progress(items, total)`` returns the items, for a progress bar over that search.

    Returns
    -------
    Identified
        With the model, and what each fit found out.

    Raises
    ------
    MeasurementError
        If a table cannot be read or is of another kind.
    IdentificationError
        If the tables do not suffice or do not fit together.
    ParameterError
        If an effect is unknown, effects are wanted without a length table, the arm is impossible in
        its units, or the lengths are no elongations of a muscle for it.

    """
    from hysteresis_ros.identification import bench
    from hysteresis_ros.model.loads import check_lengths, check_loads

    tables = {name: None if source is None else bench_table(source, name)
              for name, source in (('length', length), ('force', force))}
    names = _names(effects)
    if names != [] and tables['length'] is None:
        raise ParameterError('effects need a length table, in which effects of the load show; '
                             'give one, or no effects')
    found = bench.identify(
        tables['length'], tables['force'], force_trials=force_trials, length_trials=length_trials,
        geometry=None if geometry is None else _geometry(geometry), levels=levels,
        operator=operator, anchored=anchored)
    check_lengths(found.model, tables['length'])
    check_loads(found.model)
    if names == [] or tables['length'] is None:
        return found
    from hysteresis_ros.diagnosis.bench_effects import add_effects
    model, added = add_effects(
        found.model, tables['length'], tables['force'], names, length_trials=length_trials,
        force_trials=force_trials, jobs=jobs, progress=progress or _silent)
    # With effects H2 was fitted once more; what its first fit said no longer holds.
    return dataclasses.replace(found, model=model,
                               length_fit=None if added else found.length_fit)


def compare(model: Model, data: Sources) -> Comparison:
    """
    Compare a model with measurements, on the response simulated from the inputs alone.

    Parameters
    ----------
    model : path, MuscleModel, Identified or Extension
    data : path, Measurement, mapping, or several in a list
        Of one quantity.

    Returns
    -------
    Comparison
        Errors in the unit of the response (m, strain, N or rad) and where they occur.

    Raises
    ------
    MeasurementError
        If a measurement cannot be read, or they are of several quantities.
    ParameterError
        If the model lacks what this kind of measurement needs.

    """
    from hysteresis_ros.comparison import compare as comparison
    return comparison.compare(_model(model), _measurements(data))


def diagnose(model: Model, data: Sources, effects: str | Sequence[str] | None = None, *,
             jobs: int = -1, seed: int = 0, progress: Progress | None = None) -> Diagnosis:
    """
    Find which physical effects a model is missing, or say why none can be named.

    Parameters
    ----------
    model : path, MuscleModel, Identified or Extension
        With the effects it already has.
    data : path, Measurement, mapping, or several in a list
        Bench tables or arm runs.
    effects : str or sequence of str, optional
        Effects to try; by default the whole catalogue.
    jobs : int
        Processes; -1 for one on each core.
    seed : int
        Of the random draws behind the p values.
    progress : callable, optional
        ``progress(items, total)`` returns the items, for a progress bar.

    Returns
    -------
    Diagnosis
        Verdict, effects with parameters and intervals, and where the model fails.

    Raises
    ------
    MeasurementError
        If a measurement cannot be read, or they cannot be judged together.
    ParameterError
        If the model lacks what this kind of measurement needs, or an effect is unknown.

    """
    from hysteresis_ros.comparison import compare as comparison
    from hysteresis_ros.diagnosis import diagnose as diagnosis
    muscle, measurements = _model(model), _measurements(data)
    names = None if effects is None else _names(effects)
    found = diagnosis.diagnose(muscle, measurements, names, jobs=jobs, seed=seed,
                               progress=progress or _silent)
    where = comparison.compare(muscle, measurements).where
    return dataclasses.replace(found, where=[region.to_dict() for region in where])


def extend(model: Model, add: str | Sequence[str], data: Sources,
           test: Sources | None = None, *, force: bool = False) -> Extension:
    """
    Add effects to a model, fit them, and show the error before and after.

    Parameters
    ----------
    model : path, MuscleModel, Identified or Extension
        Stays as it is; the result holds the extended one.
    add : str or sequence of str
        Effects of the catalogue, in order; 'A,B' names two.
    data : path, Measurement, mapping, or several in a list
        Measurements to fit.
    test : path, Measurement, mapping, or several in a list, optional
        Measurements of the same kind that are only predicted.
    force : bool
        Whether effects that the data cannot show are fitted, with a warning.

    Returns
    -------
    Extension
        With the extended `model`, and errors in the unit of the response.

    Raises
    ------
    MeasurementError
        If a measurement cannot be read, or they do not fit together.
    ParameterError
        If an effect is unknown, named twice, already there, or cannot show in the data.

    """
    from hysteresis_ros.diagnosis import extend as extension
    return extension.extend(_model(model), _names(add) or [], _measurements(data),
                            [] if test is None else _measurements(test), force=force)


@overload
def predict(model: Model, data: Source, *,  # type: ignore[overload-overlap]
            method: str = 'preisach') -> np.ndarray: ...


@overload
def predict(model: Model, data: Sequence[Source], *,
            method: str = 'preisach') -> list[np.ndarray]: ...


def predict(model: Model, data: Sources, *,
            method: str = 'preisach') -> np.ndarray | list[np.ndarray]:
    """
    Simulate the response to the inputs of measurements, the memory wiped before each trial.

    Parameters
    ----------
    model : path, MuscleModel, Identified or Extension
    data : path, Measurement, mapping, or several in a list
        The response column says what to predict; its values are not looked at.
    method : {'preisach', 'linear'}
        The hysteresis model with its effects, or the linear one.

    Returns
    -------
    ndarray, shape (rows,), or list of ndarray
        Force [N], length [m], strain or angle [rad]; a list for a list.

    Raises
    ------
    MeasurementError
        If a measurement cannot be read.
    ParameterError
        If the model lacks what this kind of measurement needs, or the method is unknown.

    """
    muscle = _model(model)
    found = [muscle.predict(measurement, method) for measurement in _measurements(data)]
    return found if _several(data) else found[0]


def bench_table(source: Source, argument: str) -> Measurement:
    """
    Return a bench table and check that it is of the kind that its argument asks for.

    Parameters
    ----------
    source : path, Measurement or mapping
    argument : {'force', 'length'}

    Returns
    -------
    Measurement

    Raises
    ------
    MeasurementError
        If it cannot be read or is of another kind.

    """
    measurement, responses = _measurement(source), BENCH_RESPONSES[argument]
    if measurement.response not in responses:
        swapped = any(measurement.response in names for names in BENCH_RESPONSES.values())
        raise MeasurementError(
            f'{measurement.source}: the table measures {measurement.response}, but '
            f'{" or ".join(responses)} is needed here; '
            + ('are the force and the length table swapped?' if swapped
               else 'identify takes bench tables'))
    return measurement


def _several(data: Sources) -> bool:
    """Tell a collection of measurements from one."""
    return not (isinstance(data, (str, os.PathLike)) or hasattr(data, 'items')
                or hasattr(data, 'columns'))


def _measurements(data: Sources) -> list[Measurement]:
    """Return measurements from whatever a user has: paths, objects, columns, one or several."""
    if not _several(data):
        return [_measurement(data)]     # type: ignore[arg-type]
    try:
        found = [_measurement(source) for source in data]   # type: ignore[union-attr]
    except TypeError:
        raise ParameterError(f'a measurement cannot be a {type(data).__name__}; give a path, a '
                             'Measurement, a table of columns, or a list of them') from None
    if not found:
        raise MeasurementError('no measurement was given; name CSV files or bag folders')
    return found


def _measurement(source: Source) -> Measurement:
    """Return one measurement from a path, an object or columns."""
    from hysteresis_ros.measurements import Measurement, read_measurement
    if isinstance(source, Measurement):
        return source
    if isinstance(source, (str, os.PathLike)):
        return read_measurement(source)
    if hasattr(source, 'items'):
        return Measurement.from_columns(source)
    raise ParameterError(f'a measurement cannot be a {type(source).__name__}; give a path, a '
                         'Measurement or a table of columns')


def _model(model: Model) -> MuscleModel:
    """Return the model from a path, itself or a result that holds one."""
    from hysteresis_ros.model import MuscleModel
    if isinstance(model, (str, os.PathLike)):
        return MuscleModel.load(model)
    found = getattr(model, 'model', model)
    if not isinstance(found, MuscleModel):
        raise ParameterError(f'a model cannot be a {type(model).__name__}; give the path of a '
                             'model file or a MuscleModel')
    return found


def _geometry(geometry: Geometry) -> BicepGeometry:
    """Return the arm's geometry from a path, a mapping or itself."""
    from hysteresis_ros.bicep import BicepGeometry
    if isinstance(geometry, (str, os.PathLike)):
        return BicepGeometry.from_yaml(geometry)
    if isinstance(geometry, Mapping):
        return BicepGeometry.from_written(geometry)
    if not isinstance(geometry, BicepGeometry):
        raise ParameterError(f'a geometry cannot be a {type(geometry).__name__}; give a path, a '
                             'mapping or a BicepGeometry')
    return geometry


def _names(effects: str | Sequence[str] | None) -> list[str] | None:
    """Return the names of effects, None for 'auto', and none for None or 'none'."""
    if effects is None or effects == 'none':
        return []
    if effects == 'auto':
        return None
    names = effects.split(',') if isinstance(effects, str) else effects
    return [name.strip() for name in names if name.strip()]


def _silent(items: Iterable[Item], total: int) -> Iterable[Item]:
    return items
