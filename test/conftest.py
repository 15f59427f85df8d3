# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What all tests share: reproducible examples, quiet discovery, the checkout and its build."""

import fcntl
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import threading

import hypothesis
import pytest

ROOT = Path(__file__).resolve().parents[1]

# Whole diagnoses, whole sessions and many fits of a bench, by file: marked as slow, as single tests
# may be, too.
SLOW = ('test_bench_diagnosis', 'test_bench_expansion', 'test_bench_kinetics',
        'test_bench_overlooked', 'test_bench_problem', 'test_between_loads', 'test_demo',
        'test_diagnose', 'test_faults', 'test_firmware_machine_code', 'test_fuzz',
        'test_kernel_cache', 'test_link_states', 'test_loads', 'test_page_in_browser',
        'test_readme', 'test_replicates', 'test_studio_in_browser', 'test_table1',
        'test_whole_sets')

# Nodes and boards at work, their firmware, processes and files, the arms of the laboratory, and the
# package as a whole. They depend on ROS and on compilers, which are the same with all versions of
# the rest, and wait for each other, so that continuous integration runs them with one set of
# versions.
NODES = ('test_architecture', 'test_background', 'test_bag', 'test_benchmark', 'test_board',
         'test_board_clocks', 'test_board_heat_and_cool', 'test_bridge_node', 'test_commands',
         'test_compensator_node', 'test_cut_bag', 'test_description',
         'test_firmware_board', 'test_firmware_files', 'test_firmware_protocol', 'test_first_hour',
         'test_geometry_node', 'test_laboratory_experiments', 'test_laboratory_hidden_physics',
         'test_lifecycle', 'test_monitor_node', 'test_node_parameters', 'test_node_running',
         'test_other_master', 'test_outputs', 'test_packaging', 'test_protection', 'test_recording',
         'test_start_up', 'test_studio_live', 'test_workers')

# Searches of what acts on an arm or a bench, and what they compare. All that they call, and whole
# diagnoses by the command line, are tested with every set of versions; these with one.
SEARCHES = ('test_arm_verdict', 'test_bench_selection', 'test_covariance',
            'test_events', 'test_extend', 'test_fitted_sets', 'test_kept_strain',
            'test_linearised', 'test_monitor', 'test_recorded_room', 'test_selection',
            'test_set_fitter', 'test_valid_sets')

# Five seconds and more of a core each, with little that shorter tests do not show: marked as long.
LONG = ('test_fault_on_the_machine_code', 'test_a_pulled_cable_of_the_machine_code_likewise',
        'test_the_fuzzers_find_code_that_is_wrong', 'test_libfuzzer_finds_nothing_at_once',
        'test_a_damaged_file_is_compiled_anew', 'test_a_change_in_a_called_function_is_seen',
        'test_other_packages_keep_their_own_cache',
        'test_two_processes_that_compile_at_once_keep_both_results',
        'test_without_any_folder_functions_are_compiled_all_the_same',
        'test_pages_build_without_warnings',
        'test_a_dask_cluster_takes_the_diagnosis_as_the_readme_says',
        'test_noise_that_is_slow_is_not_taken_for_an_effect',
        'test_effect_that_begins_in_mid_run_is_named',
        'test_a_sine_as_a_trajectory_is_as_good_as_angle_by_angle',
        'test_commands_warn_of_loads_beyond_the_bench',
        'test_growth_of_another_form_has_the_right_name',
        'test_sets_that_fit_badly_on_the_coarse_grid_are_not_lost',
        'test_intervals_under_noise_that_lasts_hold_the_truth_as_often_as_they_say',
        'test_the_recording_gives_the_same_answer',
        'test_the_notebook_goes_from_the_bench_to_the_extended_model',
        'test_two_effects_that_one_could_explain_are_found_as_a_pair',
        'test_angles_shifted_after_the_recording_are_late',
        'test_a_room_that_is_heated_in_turns_drifts',
        'test_weights_that_follow_steps_show_them_too',
        'test_weights_follow_what_lies_between_the_rows',
        'test_kinetics_stay_with_what_is_found',
        'test_a_load_says_nothing_of_the_model_without_it',
        'test_its_level_is_that_of_an_f_test_with_a_row_for_each_block',
        'test_autocorrelated_noise_is_seldom_taken_for_an_effect',
        'test_on_a_bench_with_a_constant_slope_it_stays_constant',
        'test_an_effect_more_has_to_be_more_probable_than_none',
        'test_after_an_installation_nothing_is_compiled_by_a_command',
        'test_a_bench_shows_it_and_that_a_growth_was_in_part_a_softer_martensite')

# Tests of other runs on the same network must not be heard; rclpy reads this at its start.
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')

# Tests kill nodes, and what these shared in memory would stay for whoever has the domain next.
os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')

# Suites run side by side; threads of BLAS that wait for each other would take most of their time.
# Commands that the tests start see to that themselves.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

# Slow machines are no failures, and every run tries the same examples.
hypothesis.settings.register_profile('suite', deadline=None, derandomize=True, database=None)
hypothesis.settings.load_profile('suite')


def pytest_collection_modifyitems(items):
    """Mark what `-m "not slow"` and its like leave out; all that is long is slow."""
    for item in items:
        if not {item.name, getattr(item, 'originalname', None)}.isdisjoint(LONG):
            item.add_marker('long')
        if item.get_closest_marker('long'):
            item.add_marker('slow')
        for marker, stems in (('slow', SLOW), ('nodes', NODES), ('searches', SEARCHES)):
            if item.path.stem in stems:
                item.add_marker(marker)


@pytest.fixture(scope='session')
def root():
    """Return the top folder of the checkout."""
    return ROOT


@pytest.fixture
def domain_id(monkeypatch):
    """Reserve a ROS domain that no other test on this machine uses, here and in children."""
    for number in range(1, 102):    # above 101, its ports are those of outgoing connections
        name = Path(tempfile.gettempdir(), f'hysteresis_ros_domain_{number}')
        with open(name, 'w', encoding='ascii') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
            yield number
            return
    pytest.fail('all ROS domains from 1 to 101 are taken')


@pytest.fixture(scope='session')
def prefix(tmp_path_factory):
    """Return the package's prefix in a built workspace: that of make, else one built here."""
    given = os.environ.get('HYSTERESIS_ROS_PREFIX')
    if given:
        return Path(given)
    workspace = tmp_path_factory.mktemp('workspace')
    colcon(workspace, 'build', '--base-paths', str(ROOT), '--build-base', str(workspace / 'build'),
           '--install-base', str(workspace / 'install'))
    return workspace / 'install' / 'hysteresis_ros'


def colcon(workspace, *arguments):
    """Run colcon on this interpreter and return what it prints; its log goes to `workspace`."""
    code = 'import sys; from colcon_core.command import main; sys.exit(main())'
    done = subprocess.run(
        [sys.executable, '-c', code, '--log-base', str(workspace / 'log'), *arguments],
        capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def forkable():
    """End the threads that look after workers: beside them no process is forked."""
    if sys.platform != 'linux':
        pytest.skip('processes are forked on Linux only: the BLAS of others may not be')
    if 'joblib' in sys.modules:
        from joblib.externals.loky import reusable_executor
        reusable_executor.get_reusable_executor().shutdown(wait=True)
    others = [thread.name for thread in threading.enumerate()
              if thread is not threading.main_thread()]
    assert not others, f'threads of other tests are left: {others}'
