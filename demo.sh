#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From nothing to a map: installs what is missing, builds, simulates a stereo recording, imports it into
# a rawlog, plays that through the plugin, measures the result against the simulator's truth, and shows
# it. Leaves everything in demo_out/, which it replaces.
set -euo pipefail
cd "$(dirname "$0")"
out=demo_out
log=$out/demo.log
tool=build/release/bin/event-fusion

step() {
  begin=$SECONDS
  printf '[%s/6] %s\n' "$1" "$2"
}
took() { printf '      %s s\n' "$((SECONDS - begin))"; }
# Runs a command with its output in the log, and shows the log's end where it fails.
quietly() {
  if ! "$@" >>"$log" 2>&1; then
    tail -n 30 "$log" >&2
    printf 'demo.sh: failed: %s (all of its output is in %s)\n' "$*" "$log" >&2
    exit 1
  fi
}
# The first value of a key in the report.
reported() {
  sed -n "s/^ *\"$1\": *\([0-9.e+-]*\),\{0,1\}$/\1/p" "$out/map/report.json" | head -n 1
}

rm -rf "$out"
mkdir -p "$out"
step 1 "Debian packages"
scripts/install_packages.sh
took
step 2 "build (Release)"
tests=-DEFM_BUILD_TESTS=OFF # they need more packages
[ ! -e build/release/CMakeCache.txt ] || tests=
quietly cmake --preset release $tests
cmake --build --preset release --target event-fusion
took
step 3 "simulate two event cameras over a desk, 2 s"
"$tool" simulate --preset desk_stereo --out "$out/recording"
took
step 4 "import the recording into a rawlog"
"$tool" import "$out/recording" --out "$out/recording.rawlog"
took
step 5 "play the rawlog through the plugin"
"$tool" map "$out/recording.rawlog" --out "$out/map"
took
step 6 "measure the depth maps against the simulator's truth"
"$tool" evaluate depth "$out/map" "$out/recording/depth" --tolerance-px 1 --focal 226 --baseline 0.1 \
  --json >"$out/evaluation.json"
took
# The last one is that of all keyframes together.
error=$(sed -n 's/.*"median_abs_m": *\([0-9.e+-]*\).*/\1/p' "$out/evaluation.json" | tail -n 1)

printf '\n%-28s %s\n' 'keyframes' "$(reported keyframes)"
printf '%-28s %s\n' 'points of the map' "$(reported points)"
printf '%-28s %.1f cm\n' 'median depth error' "$(awk "BEGIN { print 100 * $error }")"
printf '%-28s %.0f million\n' 'votes per second' \
  "$(awk "BEGIN { print $(reported votes_per_second) / 1e6 }")"
printf '\nThe map from the top and from the side: %s/map/map.png\n' "$out"
printf 'Its keyframes: %s/map/overview.png, and one by one in %s/map/keyframes\n' "$out" "$out"
printf 'For pcl_viewer: %s/map/map.pcd. Counts and times: %s/map/report.json\n' "$out" "$out"
printf 'In a browser: '
"$tool" view "$out/map"
printf '\nNow your own recording: docs/your-data.md\n'
