# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Score the monitor on arms of the virtual laboratory, without a clock and without ROS.

Every case is an arm that is fine for a while; then an effect begins. The holds that the monitor's
detector would find go to `diagnosis.watch` with the prediction of the specimen's model, and what
that has diagnosed is diagnosed. Named is an effect that a finding has among its effects or among
those that the data cannot tell from them. Clean arms run for as long as is asked.
"""

import argparse
import json
from pathlib import Path
import sys
import time

from hidden import base_model
from hysteresis_ros.diagnosis.band import error_band
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.watch import Watch
from hysteresis_ros.laboratory import sequences
from hysteresis_ros.laboratory.plant import Plant
from hysteresis_ros.measurements.live_holds import Hold
from hysteresis_ros.workers import delayed, in_parallel
import numpy as np

# What can begin while an arm runs and shows in settled states, with its sign.
SUDDEN = {
    'supply_sag': 1, 'pwm_dead_zone': 1, 'airflow': 1, '-airflow': -1, 'payload_error': 1,
    '-payload_error': -1, 'clamp_mass': 1, 'geometry_error': 1, '-geometry_error': -1,
    'frame_tilt': 1, '-frame_tilt': -1, 'end_stop': 1, '-end_stop': -1, 'encoder_offset': 1,
    '-encoder_offset': -1, 'backlash': 1, 'coulomb_friction': 1, 'slack': 1,
    'series_compliance': 1}
HOLD = 30.0
BEFORE, AFTER, PATIENCE = 30, 24, 20
RANDOM, RAMPS = sequences.random_moves, sequences.up_and_down


def run(name: str, seed: int, model, strength: float, holds: int) -> dict:
    """Return what the monitor says of one arm; with no name of an effect it is a clean one."""
    effects = {name.lstrip('-'): SUDDEN[name] * strength} if name else {}
    number = list(SUDDEN).index(name) if name else len(SUDDEN)
    rng = np.random.default_rng([seed, number, 31])
    begin = HOLD * BEFORE if name else 0.0
    arm = Plant(seed, effects, recording=7, effects_after=begin)
    kind = (RANDOM, RAMPS)[(seed + number) % 2]
    drive = np.concatenate([kind(60, rng) for _ in range(holds // 60 + 1)])[:holds]
    watch, observer = Watch(error_band(model), 1800.0), model.observer()
    row = {'effect': name, 'seed': seed, 'strength': strength, 'holds': holds, 'band': watch.band,
           'named_after': None, 'first': [], 'findings': [], 'diagnoses': 0, 'cpu': 0.0}
    before = None
    for count, voltage in enumerate(drive.tolist(), 1):
        arm.arm.settle(HOLD, voltage)
        angle, ambient, _ = arm.read()
        last = arm.arm.time, voltage, angle, observer.step(arm.arm.time, voltage, ambient), ambient
        ways = [sorted(pair) for pair in zip(before or (voltage, angle), (voltage, angle))]
        watch.add(Hold(*last, *ways[1], *ways[0]))
        before = voltage, angle
        if not watch.due:
            continue
        started = time.process_time()
        watch.begun()
        found = diagnose(model, [watch.measurement()])
        watch.answer(found)
        row['diagnoses'] += 1
        row['cpu'] += time.process_time() - started
        if watch.finding is None or not watch.finding.effects:
            continue
        said = [count, *watch.finding.effects, *watch.finding.others]
        if not row['findings'] or row['findings'][-1][1:] != said[1:]:
            row['findings'].append(said)
        if name.lstrip('-') in said and row['named_after'] is None:
            row['named_after'] = count - BEFORE
            row['first'] = list(watch.finding.effects)
    return row


def main() -> None:
    """Run the cases and print the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--specimens', type=int, default=3)
    parser.add_argument('--first-seed', type=int, default=5000)
    parser.add_argument('--strength', type=float, default=1.0)
    parser.add_argument('--clean-hours', type=float, default=24.0, help='of each specimen')
    parser.add_argument('--only', help='one effect, or clean')
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('output', nargs='?', default='monitoring.json')
    args = parser.parse_args()
    seeds = range(args.first_seed, args.first_seed + args.specimens)
    models = dict(zip(seeds, in_parallel(
        [delayed(base_model)('grains', seed, True) for seed in seeds], args.jobs)))
    names = [name for name in SUDDEN if args.only in (None, name)]
    cases = [(name, seed, BEFORE + AFTER) for seed in seeds for name in names]
    if args.only in (None, 'clean'):
        cases += [('', seed, int(args.clean_hours * 3600.0 / HOLD)) for seed in seeds]
    rows = []
    for row in in_parallel([delayed(run)(name, seed, models[seed], args.strength, holds)
                            for name, seed, holds in cases], args.jobs):
        rows.append(row)
        print(row, file=sys.stderr, flush=True)
        Path(args.output).write_text(json.dumps(rows, indent=1) + '\n', encoding='utf-8')
    print_scores(rows)


def print_scores(rows: list) -> None:
    """Print how many are named, how soon, and what was named on clean arms."""
    sudden = [row for row in rows if row['effect']]
    clean = [row for row in rows if not row['effect']]
    if sudden:
        after = [row['named_after'] for row in sudden]
        named = [count for count in after if count is not None and count <= PATIENCE]
        print(f'named within {PATIENCE} holds: {len(named)} of {len(sudden)} '
              f'({100.0 * len(named) / len(sudden):.0f} %), median {np.median(named):.0f} holds')
        missed = [row for row in sudden if row['named_after'] is None
                  or row['named_after'] > PATIENCE]
        print('not named: ' + (', '.join(
            f'{row["effect"]} ({row["seed"]})' for row in missed) or 'none'))
        wrong = sum(any(row['effect'].lstrip('-') not in said for said in row['findings'])
                    for row in sudden)
        print(f'something else named at some time: {wrong}')
    if clean:
        hours = sum(row['holds'] for row in clean) * HOLD / 3600.0
        print(f'clean: {sum(bool(row["findings"]) for row in clean)} of {len(clean)} arms with an '
              f'effect named in {hours:.0f} h; {sum(row["diagnoses"] for row in clean)} diagnoses')
    cpu = [row['cpu'] / row['diagnoses'] for row in rows if row['diagnoses']]
    if cpu:
        print(f'a diagnosis takes {np.median(cpu):.1f} s of a core')


if __name__ == '__main__':
    main()
