# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The physical effects that the laboratory can switch on, each as a change of the arm's conditions.

A strength of 1 is strong: a user would notice it at once. A strength of 0.4 is weak. The exact size
is drawn within 15 % for each specimen. Where `signed`, a negative strength turns the effect round
(a lighter payload, a cooler room, a stop at the other end, ...).
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.cable import Cable
from hysteresis_ros.laboratory.conditions import Conditions, FULL_VOLTAGE, RESISTANCE
from hysteresis_ros.laboratory.encoder_disc import EncoderDisc
from hysteresis_ros.laboratory.heat import SPECIFIC_HEAT
from hysteresis_ros.laboratory.still_air import StillAir
from hysteresis_ros.laboratory.supply import Supply
from hysteresis_ros.laboratory.unlisted import Unlisted, UNLISTED
from hysteresis_ros.spelling import unknown

# Specimens differ in an effect's size by up to this share.
SPREAD = 0.15
# Enthalpy of the transformation [J/kg].
ENTHALPY = 24e3
# Coefficient of thermal expansion of both phases [1/K], as in the examples of Lagoudas and others,
# Int. J. Plasticity 32-33 (2012) 155.
EXPANSION = 22e-6

# Changes conditions: (conditions, size, specimen, recording).
Apply = Callable[[Conditions, float, np.random.Generator, np.random.Generator], None]


@dataclasses.dataclass(frozen=True)
class Effect:
    """
    One effect of the laboratory.

    Parameters
    ----------
    sentence : str
        What it is.
    apply : callable
        ``apply(conditions, size, specimen, recording)`` changes the conditions: `size` is the
        strength, the others are random generators for what belongs to the arm, and for what
        differs from one recording to the next.
    signed : bool
        Whether a negative strength makes sense.
    bench : bool
        Whether it belongs to the wire itself and so acts on the bench, too.
    listed : bool
        Whether the catalogue of effects has it.
    """

    sentence: str
    apply: Apply
    signed: bool = False
    bench: bool = False
    listed: bool = True


def _supply_sag(conditions: Conditions, size: float, specimen: np.random.Generator,
                recording: np.random.Generator) -> None:
    conditions.lead_resistance = 0.9 * size


def _measured_supply(conditions: Conditions, size: float, specimen: np.random.Generator,
                     recording: np.random.Generator) -> None:
    conditions.supply = Supply(
        drain=0.2 * size, dip=0.07 * size, duration=conditions.recording_time,
        begin=recording.uniform(0.0, 1.0))


def _pwm_dead_zone(conditions: Conditions, size: float, specimen: np.random.Generator,
                   recording: np.random.Generator) -> None:
    conditions.dead_voltage = 1.0 * size


def _supply_limit(conditions: Conditions, size: float, specimen: np.random.Generator,
                  recording: np.random.Generator) -> None:
    # Wires are hot from 4.5 to 5.5 V on, so that a limit shows below that.
    conditions.largest_current = (FULL_VOLTAGE - 0.88 - 0.37 * size) / RESISTANCE


def _resistance_change(conditions: Conditions, size: float, specimen: np.random.Generator,
                       recording: np.random.Generator) -> None:
    conditions.resistance_growth = 0.17 * size


def _thermal_lag(conditions: Conditions, size: float, specimen: np.random.Generator,
                 recording: np.random.Generator) -> None:
    conditions.heat.time_constant = max(conditions.heat.time_constant, 6.0 * size)


def _heating_cooling_asymmetry(conditions: Conditions, size: float, specimen: np.random.Generator,
                               recording: np.random.Generator) -> None:
    conditions.heat.time_constant = max(conditions.heat.time_constant, 3.0)
    conditions.heat.heating_ratio = 2.0 ** (0.87 * size)


def _latent_heat(conditions: Conditions, size: float, specimen: np.random.Generator,
                 recording: np.random.Generator) -> None:
    conditions.heat.time_constant = max(conditions.heat.time_constant, 2.0)
    conditions.heat.latent = ENTHALPY / SPECIFIC_HEAT * size


def _heat_loss(conditions: Conditions, size: float, specimen: np.random.Generator,
               recording: np.random.Generator) -> None:
    conditions.heat.time_constant = max(conditions.heat.time_constant, 4.0)
    conditions.heat.air = StillAir(min(0.85 * size, 1.0))


def _ambient_temperature(conditions: Conditions, size: float, specimen: np.random.Generator,
                         recording: np.random.Generator) -> None:
    conditions.air.swing = 12.0 * size
    conditions.air.period = 0.45 * conditions.recording_time
    conditions.air.phase = recording.uniform(0.0, 2.0 * math.pi)


def _ambient_drift(conditions: Conditions, size: float, specimen: np.random.Generator,
                   recording: np.random.Generator) -> None:
    conditions.air.warming = 15.0 * size
    conditions.air.warming_time = 0.6 * conditions.recording_time


def _airflow(conditions: Conditions, size: float, specimen: np.random.Generator,
             recording: np.random.Generator) -> None:
    factor = 1.0 + 0.35 * abs(size)
    conditions.heat.airflow *= factor if size > 0.0 else 1.0 / factor


def _stress_dependence(conditions: Conditions, size: float, specimen: np.random.Generator,
                       recording: np.random.Generator) -> None:
    factor = 1.0 + 0.35 * abs(size)
    conditions.material = conditions.material.with_slopes(
        1.0 / factor if size > 0.0 else factor)


def _stress_dependent_strain(conditions: Conditions, size: float, specimen: np.random.Generator,
                             recording: np.random.Generator) -> None:
    conditions.material = conditions.material.with_strain_growth(1.0 + 0.5 * size)


def _r_phase(conditions: Conditions, size: float, specimen: np.random.Generator,
             recording: np.random.Generator) -> None:
    conditions.material = conditions.material.with_early_phase(0.0085 * size)


def _formation_memory(conditions: Conditions, size: float, specimen: np.random.Generator,
                      recording: np.random.Generator) -> None:
    conditions.material = conditions.material.with_kept_strain(min(0.85 * size, 1.0))


def _cold_clamps(conditions: Conditions, size: float, specimen: np.random.Generator,
                 recording: np.random.Generator) -> None:
    conditions.material = conditions.material.with_cold_ends(0.15 * size)


def _creep(conditions: Conditions, size: float, specimen: np.random.Generator,
           recording: np.random.Generator) -> None:
    conditions.creep = 0.004 * size


def _fatigue(conditions: Conditions, size: float, specimen: np.random.Generator,
             recording: np.random.Generator) -> None:
    conditions.shrinkage = 0.0025 * size
    conditions.tiring = 0.02 * size


def _slack(conditions: Conditions, size: float, specimen: np.random.Generator,
           recording: np.random.Generator) -> None:
    conditions.dead_length = 0.0035 * size


def _series_compliance(conditions: Conditions, size: float, specimen: np.random.Generator,
                       recording: np.random.Generator) -> None:
    conditions.compliance = size / 2500.0


def _thermal_expansion(conditions: Conditions, size: float, specimen: np.random.Generator,
                       recording: np.random.Generator) -> None:
    conditions.expansion = EXPANSION * size


def _unequal_muscles(conditions: Conditions, size: float, specimen: np.random.Generator,
                     recording: np.random.Generator) -> None:
    conditions.wire_offsets = (-0.004 * size, 0.0, 0.004 * size)


def _overload(conditions: Conditions, size: float, specimen: np.random.Generator,
              recording: np.random.Generator) -> None:
    conditions.yield_tension, conditions.yield_compliance = 5.8, 0.006 * size


def _wire_break(conditions: Conditions, size: float, specimen: np.random.Generator,
                recording: np.random.Generator) -> None:
    # A wire is broken or it is not: where that shows little, it happens late.
    passed = 1.0 - 0.5 * size + recording.uniform(-0.1, 0.1)
    conditions.break_time = max(passed, 0.05) * conditions.recording_time


def _coulomb_friction(conditions: Conditions, size: float, specimen: np.random.Generator,
                      recording: np.random.Generator) -> None:
    conditions.coulomb = 0.08 * size


def _cable_friction(conditions: Conditions, size: float, specimen: np.random.Generator,
                    recording: np.random.Generator) -> None:
    conditions.cable = Cable(friction=0.15 * size, wrap=math.radians(90.0))


def _viscous_friction(conditions: Conditions, size: float, specimen: np.random.Generator,
                      recording: np.random.Generator) -> None:
    conditions.viscous = 2.5 * size


def _inertia(conditions: Conditions, size: float, specimen: np.random.Generator,
             recording: np.random.Generator) -> None:
    conditions.inertia = 0.03 * size


def _change_linkage(conditions: Conditions, **values: Any) -> None:
    conditions.linkage = dataclasses.replace(conditions.linkage, **values)


def _payload_error(conditions: Conditions, size: float, specimen: np.random.Generator,
                   recording: np.random.Generator) -> None:
    _change_linkage(conditions, payload_mass=conditions.linkage.payload_mass + 0.050 * size)


def _clamp_mass(conditions: Conditions, size: float, specimen: np.random.Generator,
                recording: np.random.Generator) -> None:
    _change_linkage(conditions, clamp_mass=0.026 * size, clamp_radius=0.05, clamp_phase=0.3)


def _geometry_error(conditions: Conditions, size: float, specimen: np.random.Generator,
                    recording: np.random.Generator) -> None:
    linkage = conditions.linkage
    _change_linkage(conditions, clamp_distance=linkage.clamp_distance + 0.0025 * size,
                    anchor_height=linkage.anchor_height + 0.0015 * size)


def _frame_tilt(conditions: Conditions, size: float, specimen: np.random.Generator,
                recording: np.random.Generator) -> None:
    _change_linkage(conditions, tilt=math.radians(18.0) * size)


def _end_stop(conditions: Conditions, size: float, specimen: np.random.Generator,
              recording: np.random.Generator) -> None:
    lowered, raised = conditions.material.arm_range
    cut = 0.25 * abs(size) * (lowered - raised)
    conditions.stop_side = 1 if size > 0.0 else -1
    conditions.stop = math.radians(lowered - cut if size > 0.0 else raised + cut)


def _encoder_offset(conditions: Conditions, size: float, specimen: np.random.Generator,
                    recording: np.random.Generator) -> None:
    conditions.encoder_offset = math.radians(9.0) * size


def _encoder_eccentricity(conditions: Conditions, size: float, specimen: np.random.Generator,
                          recording: np.random.Generator) -> None:
    conditions.disc = EncoderDisc(off_centre=0.0012 * size,
                                  direction=specimen.uniform(-math.pi, math.pi))


def _encoder_scale(conditions: Conditions, size: float, specimen: np.random.Generator,
                   recording: np.random.Generator) -> None:
    # Set to an angle on one end of the arm's way or beyond it.
    lowered, raised = (math.radians(angle) for angle in conditions.material.arm_range)
    end = specimen.choice([lowered, raised, 0.0])
    conditions.disc = EncoderDisc(pulses=1.0 + 0.2 * size, counted_from=float(end))


def _backlash(conditions: Conditions, size: float, specimen: np.random.Generator,
              recording: np.random.Generator) -> None:
    conditions.backlash = math.radians(8.0) * size
    # Turned back by hand before it is zeroed, or left as the muscles have cooled down.
    conditions.backlash_used = float(specimen.integers(0, 2))


def _latency(conditions: Conditions, size: float, specimen: np.random.Generator,
             recording: np.random.Generator) -> None:
    conditions.latency = 2.0 * size


LISTED = {
    'supply_sag': Effect('Leads and board in series with the wire take a part of the voltage.',
                         _supply_sag),
    'pwm_dead_zone': Effect('The board gives nothing below a smallest voltage.', _pwm_dead_zone),
    'resistance_change': Effect('Martensite has more resistance than austenite, so the same '
                                'voltage heats it less.', _resistance_change, signed=True),
    'thermal_lag': Effect('The wire takes seconds to warm up and to cool down.', _thermal_lag),
    'heating_cooling_asymmetry': Effect('The wire warms up faster than it cools down (time '
                                        'constant 3 s while cooling).',
                                        _heating_cooling_asymmetry, signed=True),
    'latent_heat': Effect('The transformation takes up heat and gives it off again (time constant '
                          '2 s outside it).', _latent_heat),
    'ambient_temperature': Effect('The room gets warmer and colder; a thermometer records it.',
                                  _ambient_temperature, signed=True),
    'ambient_drift': Effect('The air at the wires warms up over the recording; nobody records it.',
                            _ambient_drift, signed=True),
    'airflow': Effect('The fan blows harder than it did at the bench.', _airflow, signed=True),
    'stress_dependence': Effect('Stress shifts the transformation further (smaller C).',
                                _stress_dependence, signed=True, bench=True),
    'stress_dependent_strain': Effect('The transformation strain grows further with the stress.',
                                      _stress_dependent_strain, signed=True, bench=True),
    'r_phase': Effect('A second, early transformation with little hysteresis.', _r_phase,
                      bench=True),
    'creep': Effect('The wire goes on in the direction of its last step, with the logarithm of '
                    'time.', _creep, bench=True),
    'fatigue': Effect('With every cycle the wire gets shorter and more of it stays martensite; '
                      'where negative, it is in training: it gets longer, and less stays.',
                      _fatigue, signed=True, bench=True),
    'slack': Effect('A part of each wire hangs loose.', _slack, bench=True),
    'series_compliance': Effect('Crimps and cable stretch in series with the wire.',
                                _series_compliance, bench=True),
    'unequal_muscles': Effect('The three wires differ in length.', _unequal_muscles),
    'coulomb_friction': Effect('The shaft rubs and sticks.', _coulomb_friction),
    'viscous_friction': Effect('Something thick slows the shaft down.', _viscous_friction),
    'inertia': Effect('The arm is heavy enough to swing through.', _inertia),
    'payload_error': Effect('The weight is heavier than assumed.', _payload_error, signed=True),
    'clamp_mass': Effect('The clamp has a mass.', _clamp_mass),
    'geometry_error': Effect('The clamp sits further out, and the anchor higher, than assumed.',
                             _geometry_error, signed=True),
    'frame_tilt': Effect('The frame leans.', _frame_tilt, signed=True),
    'end_stop': Effect('The arm meets a stop before its range ends.', _end_stop, signed=True),
    'encoder_offset': Effect('The encoder was set to zero at a wrong angle.', _encoder_offset,
                             signed=True),
    'backlash': Effect('There is play between shaft and encoder.', _backlash),
    'latency': Effect('Angles arrive late.', _latency),
}


def _disturb(kind: type[Unlisted]) -> Apply:
    def apply(conditions: Conditions, size: float, specimen: np.random.Generator,
              recording: np.random.Generator) -> None:
        conditions.disturbances.append(kind(size, conditions, specimen, recording))
    return apply


# What was added later comes last: an effect's place is a part of the seed of its size.
LATER = {
    'cable_friction': Effect('The cables between wires and forearm rub on their guides.',
                             _cable_friction),
    'encoder_eccentricity': Effect("The encoder's disc sits off the centre of its shaft.",
                                   _encoder_eccentricity),
    'measured_supply': Effect('The battery runs down and dips; the board counts on its nominal '
                              'voltage, and a meter records it.', _measured_supply),
    'heat_loss': Effect('Still air takes heat off a hot wire faster than off a warm one (time '
                        'constant 4 s in the air of the bench).', _heat_loss),
    'overload': Effect('The arm loads its wires beyond their yield stress, and they stay longer.',
                       _overload),
    'formation_memory': Effect('Martensite keeps the strain of the load under which it formed.',
                               _formation_memory, bench=True),
    'cold_clamps': Effect("Heavy clamps keep the ends of the arm's wires cold; the bench has long "
                          'wires.', _cold_clamps),
}

# What only a bench tells; an arm has the wire of its bench.
OF_WIRES = {
    'thermal_expansion': Effect('The wire expands with its temperature.', _thermal_expansion,
                                bench=True),
}

# What was added after that.
LATEST = {
    'supply_limit': Effect('The board limits the current of each wire.', _supply_limit),
    'encoder_scale': Effect('The encoder has another number of pulses than assumed.',
                            _encoder_scale, signed=True),
}

# Here stood a torn wire while no catalogue had it.
BEFORE = 'unlisted_flexed_lead'
TORN = {'wire_break': Effect('One of the wires breaks; the others carry its load.', _wire_break)}


def _in_order() -> dict[str, Effect]:
    found = dict(LISTED)
    for name, kind in UNLISTED.items():
        if name == BEFORE:
            found.update(TORN)
        found[name] = Effect(kind.__doc__ or '', _disturb(kind), listed=False)
    return {**found, **LATER, **OF_WIRES, **LATEST}


EFFECTS = _in_order()


def hidden_effects() -> tuple[str, ...]:
    """Return the names of the effects that the catalogue has for an arm, too."""
    return (*LISTED, *LATER, *TORN, *LATEST)


def unlisted_effects() -> tuple[str, ...]:
    """Return the names of the effects that no catalogue has."""
    return tuple(UNLISTED)


def apply_effects(conditions: Conditions, effects: Mapping[str, float], seed: int,
                  recording: int = 0, bench: bool = False) -> Conditions:
    """
    Switch effects on.

    Parameters
    ----------
    conditions : Conditions
        Changed in place.
    effects : mapping of str to float
        Strength of each effect.
    seed : int
        Of the specimen, for the exact sizes.
    recording : int
        Which recording of it, for what happens at random moments.
    bench : bool
        Whether to take only those that act on the bench.

    Returns
    -------
    Conditions
        The same object.

    Raises
    ------
    ParameterError
        For an effect that does not exist or a strength that makes no sense.
    """
    names = list(EFFECTS)
    for name, strength in effects.items():
        if name not in EFFECTS:
            raise ParameterError(f'laboratory: {unknown("effect", name, names)}')
        effect = EFFECTS[name]
        least = -2.0 if effect.signed else 0.0
        if not (math.isfinite(strength) and least <= strength <= 2.0):
            raise ParameterError(f'laboratory: the strength of {name} has to be from {least:g} '
                                 f'to 2, not {strength!r}')
        if strength == 0.0 or bench and not effect.bench:
            continue
        specimen = np.random.default_rng([seed, names.index(name)])
        size = strength * (1.0 + SPREAD * specimen.uniform(-1.0, 1.0))
        effect.apply(conditions, size, specimen,
                     np.random.default_rng([seed, names.index(name), 1 + recording]))
    return conditions
