#!/bin/sh
# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
#
# Draws the pictures of docs/ and of the README anew: pictures.sh HYSTERESIS PYTHON FOLDER.
#
# `make pictures` calls it. FOLDER takes all that the demos write. The mean errors are printed in the
# pictures; README.md and docs/results.md repeat them, and are brought up to date by hand.

set -eu
hysteresis=$1 python=$2 folder=$3

mkdir -p "$folder"
"$hysteresis" demo -o "$folder/demo"
"$hysteresis" demo -o "$folder/hidden" --hidden payload_error --effects auto
"$python" tools/arm_picture.py "$folder/arm.png"
cp "$folder/demo/demo.png" docs/demo.png
cp "$folder/hidden/demo.png" docs/hidden.png
PYTHONPATH=".:test${PYTHONPATH:+:$PYTHONPATH}" "$python" tools/studio_picture.py "$folder/studio" "$folder/studio.png"
cp "$folder/arm.png" docs/arm.png
cp "$folder/studio.png" docs/studio.png
echo 'docs/demo.png docs/hidden.png docs/arm.png docs/studio.png'
