#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Writes a dataset folder in all formats, with independent programs.
#   write_all.sh DATASET_FOLDER OUT
set -eu
here=$(cd "$(dirname "$0")" && pwd)
for family in text evimo2 numpy hdf5 raw aedat4 ros1_bag ros2_bag; do
  mkdir -p "$2/$family"
  /usr/bin/python3 "$here/write_$family.py" "$1" "$2/$family"
done
