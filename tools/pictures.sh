#!/bin/sh
# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
#
# Draw the pictures of docs/ and of the README: pictures.sh HYSTERESIS PYTHON FOLDER.
# Called by the Makefile; the demos write into FOLDER, and what they print goes to docs/*.png's
# neighbours in the text by hand: the mean errors stand in the pictures, too.

set -eu
hysteresis=$1 python=$2 folder=$3

mkdir -p "$folder"
"$hysteresis" demo -o "$folder/demo"
"$hysteresis" demo -o "$folder/hidden" --hidden payload_error --effects auto
"$python" tools/arm_picture.py "$folder/arm.png"
cp "$folder/demo/demo.png" docs/demo.png
cp "$folder/hidden/demo.png" docs/hidden.png
cp "$folder/arm.png" docs/arm.png
echo 'docs/demo.png docs/hidden.png docs/arm.png'
