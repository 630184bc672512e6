#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Films the map of a real recording as it grows, slider_depth of the UZH event camera dataset: demo/slider.gif, under 2 MB.
# Needs the program (./test.sh or ./demo.sh builds it) and Python with PIL (Debian: python3-pil).
#   make_film.sh [SLIDER_DEPTH [OUT.gif]]      default: ../shared/data/slider_depth, demo/slider.gif
set -euo pipefail
cd "$(dirname "$0")/../.."
recording=${1:-../shared/data/slider_depth}
out=${2:-demo/slider.gif}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The events end after 0.17 s. A keyframe every 2 ms makes the map grow over some 40 frames.
build/release/bin/event-fusion map --quiet "$recording" --config davis240c_slider \
  --set keyframes.policy=period --set keyframes.stride_s=0.002 --set keyframes.window_s=0.08 \
  --record-frames "$work/frames" --out "$work/map"

/usr/bin/python3 - "$work/frames" "$out" <<'PYTHON'
import glob
import sys
from PIL import Image

names = sorted(glob.glob(sys.argv[1] + "/frame_*.png"))
# One palette for all frames, from the last one: it has all colours.
size = (800, 450)
frames = [Image.open(name).convert("RGB").resize(size, Image.LANCZOS) for name in names]
palette = frames[-1].quantize(colors=64)
frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
times_ms = [100] * (len(frames) - 1) + [2000]
frames[0].save(sys.argv[2], save_all=True, append_images=frames[1:], duration=times_ms, loop=0,
               optimize=True)
print(f"{sys.argv[2]}: {len(frames)} frames")
PYTHON
size=$(stat -c %s "$out")
echo "$size bytes"
[ "$size" -lt 2000000 ] || { echo "$out: expected less than 2 MB" >&2; exit 1; }
