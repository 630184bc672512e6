#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes the pictures of README.md and docs/your-data.md again, with the built program and the packages of packages.txt.
#   make.sh [BUILD [FOLDER]]   BUILD: the build folder, by default build/release. FOLDER: a new or an empty one that keeps
#                              the recordings and maps; by default a temporary one
# The real recording is slider_depth of the UZH Event Camera Dataset: the text version from
# https://rpg.ifi.uzh.ch/davis_data.html, unpacked. SLIDER=DIR says where; without it, its pictures stay as they are.
# Each fault must end with the warning that the guide quotes: else the script fails.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
tool=$(realpath "${1:-$root/build/release}")/bin/event-fusion
slider=$(realpath -m "${SLIDER:-$root/../shared/data/slider_depth}")
if [ $# -ge 2 ]; then
  mkdir -p "$2"
  cd "$2"
else
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  cd "$work"
fi

# picture MAP NAME: the depth map of a keyframe in the middle.
picture() {
  local target=$here/$2_depth.png
  local keyframes=("$1"/keyframes/*/)
  cp "${keyframes[$((${#keyframes[@]} / 2))]}depth.png" "$target"
  "$here/shrink_png.py" "$target"
}

# map_of RECORDING NAME [OPTION…]: a map and its pictures; the warnings are in NAME.txt.
map_of() {
  local recording=$1 name=$2
  shift 2
  "$tool" map "$recording" --out "map_$name" -q "$@" 2>"$name.txt"
  picture "map_$name" "$name"
}

# fault NAME WARNING: a copy of the desk with the files that the caller writes to NAME/ gives this warning.
fault() {
  local name=$1 warning=$2
  shift 2
  map_of "recording_$name" "$name" "$@"
  if ! grep -q "warning: $warning:" "$name.txt"; then
    printf 'make.sh: %s: expected the warning %s, got:\n' "$name" "$warning" >&2
    cat "$name.txt" >&2
    exit 1
  fi
  sed -n "s/^event-fusion: warning: $warning:/$name: $warning:/p" "$name.txt"
}

# copy NAME: the desk again, as recording_NAME.
copy() {
  mkdir "recording_$1"
  cp -r desk/cam0 desk/cam1 desk/camchain.yaml desk/poses.txt "recording_$1"
}

# change NAME PROGRAM: awk's program on each pose of a copy of the desk: t x y z qx qy qz qw.
change() {
  copy "$1"
  awk -v CONVFMT=%.12g "/^#/ { print; next } $2" desk/poses.txt >"recording_$1/poses.txt"
}

if [ -d "$slider" ]; then
  map_of "$slider" slider
else
  printf 'make.sh: no recording in %s: the pictures of the slider stay (SLIDER=DIR)\n' "$slider" >&2
fi

"$tool" simulate --preset desk_stereo --out desk -q
map_of desk desk
[ ! -s desk.txt ] || { cat desk.txt >&2; exit 1; }

change late '{ $1 = sprintf("%.9f", $1 + 0.1); print }'
fault late time-shift

copy swapped
mv recording_swapped/cam0 recording_swapped/cam2
mv recording_swapped/cam1 recording_swapped/cam0
mv recording_swapped/cam2 recording_swapped/cam1
fault swapped cameras-swapped

copy limits
fault limits depths-at-limit --set dsi.max_depth_m=0.9

change rotation 'n++ == 0 { x = $2; y = $3; z = $4 } { $2 = x; $3 = y; $4 = z; print }'
fault rotation rotation-only

# The inverse of each pose: the conjugate quaternion, and -R^T t.
change inverted '{
  x = -$5; y = -$6; z = -$7; w = $8
  print $1, -((1 - 2 * (y * y + z * z)) * $2 + 2 * (x * y - z * w) * $3 + 2 * (x * z + y * w) * $4),
      -(2 * (x * y + z * w) * $2 + (1 - 2 * (x * x + z * z)) * $3 + 2 * (y * z - x * w) * $4),
      -(2 * (x * z - y * w) * $2 + 2 * (y * z + x * w) * $3 + (1 - 2 * (x * x + y * y)) * $4), x, y, z, w }'
fault inverted poses-inverted

change scale '{ $2 *= 2; $3 *= 2; $4 *= 2; print }'
fault scale scale

# The figures of docs/python.md.
PYTHONPATH=$(realpath "$(dirname "$tool")/../python") MPLBACKEND=agg /usr/bin/python3 - "$here/python.png" <<'END'
import sys

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

import event_fusion as ef
from event_fusion import plot

desk = ef.open("desk")
made = ef.map(desk)
keyframe = made.keyframes[len(made.keyframes) // 2]
figure, axes = plt.subplots(2, 3, figsize=(13, 6.5), layout="constrained")
plot.depth(keyframe, axes[0, 0])
plot.confidence(keyframe, axes[0, 1])
plot.error(keyframe, desk, axes[0, 2], tolerance_px=1)
plot.precision_recall(ef.evaluate.depth(made, desk, tolerance_px=1), axes[1, 0])
plot.map(made, axes[1, 1])
plot.trajectory(desk, made, labels=["tracker", "keyframes"], ax=axes[1, 2])
figure.dpi = 100
figure.canvas.draw()
Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3]).save(sys.argv[1])
END
"$here/shrink_png.py" "$here/python.png"
