#!/bin/sh
# Runs pytest twice side by side, as nodes wait for each other most of their time; without the tests
# that take many seconds each.
#
#   tools/quick_tests.sh PYTEST [ARGS...]
#
# Fails when one of the two fails. What nodes and linters print comes last.
set -u
log=$(mktemp)
"$@" -m '(nodes or linter) and not slow' > "$log" 2>&1 &
nodes=$!
# A shell lets what it started in the background live when it is interrupted itself.
trap 'kill "$nodes" 2>/dev/null; rm -f "$log"' EXIT
trap 'exit 130' INT TERM

status=0
"$@" -m 'not (nodes or linter) and not slow' || status=1
wait "$nodes" || status=1
cat "$log"
echo 'Whole diagnoses and sessions were left out: make test-all.'
exit "$status"
