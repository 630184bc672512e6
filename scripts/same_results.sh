#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Compares the results of two builds: the files that they write, their exit statuses, and what they print. What
# depends on time or memory alone is left out. Exit status 1 if anything differs.
#   same_results.sh [--quick] OLD_BIN NEW_BIN      each a folder such as build/release/bin, with ../lib beside it
# --quick runs the desk and four formats: some minutes instead of an hour.
# Pictures are compared by their pixels. A job that fails in both builds is named, too: what it should have made was
# not compared.
# The recordings are simulated once, by OLD_BIN: three presets, a piece of the desk in every format (test/formats),
# and the real slider of ../shared/data if it is there. They are kept in build/same_results/in: remove that folder to
# make them anew.
set -euo pipefail
quick=
if [ "${1:-}" = --quick ]; then
  quick='^(version|desk[.](map|live|info|offsets|hand_eye|cameras|rawlog)|csv|mvsec|evt3|mcap) '
  shift
fi
old=$(realpath "${1:?usage: same_results.sh [--quick] OLD_BIN NEW_BIN}")
new=$(realpath "${2:?usage: same_results.sh OLD_BIN NEW_BIN}")
root=$(cd "$(dirname "$0")/.." && pwd)
work="$root/build/same_results"
in="$work/in"
mkdir -p "$work"

program() { LD_LIBRARY_PATH="$1/../lib" "$1/event-fusion" "${@:2}"; }

make_recordings() {
  local making="$work/making"
  rm -rf "$making"
  mkdir "$making"
  program "$old" simulate -q --preset desk_stereo --duration 2 --out "$making/desk" &
  program "$old" simulate -q --preset drive_stereo --out "$making/drive"
  wait $!
  program "$old" simulate -q --preset trinocular --out "$making/trinocular"
  program "$old" export -q "$making/desk" --to folder --t0 1.4 --t1 1.65 --out "$making/piece"
  "$root/test/formats/write_all.sh" "$making/piece" "$making/formats"
  [ ! -d "$root/../shared/data/slider_depth" ] || ln -s "$(realpath "$root/../shared/data/slider_depth")" "$making/slider"
  mv "$making" "$in"
}

# A line is the name of a job and its commands for the shell, run in a folder of its own. $i is the folder of the
# recordings, fusion and host are the programs.
jobs_table() {
  local recording name sources needs
  echo 'simulate fusion simulate --preset slider --duration 0.2 --seed 7 --out out'
  echo 'version fusion --version; fusion info --system; fusion nothing'
  for recording in desk drive trinocular slider; do
    [ -e "$in/$recording" ] || continue
    echo "$recording.map fusion map \$i/$recording --out out --set output.ply=true --set output.camera_maps=true"
    echo "$recording.paper fusion map \$i/$recording --out out --config $root/config/paper.ini -v"
    echo "$recording.refined fusion map \$i/$recording --out out --set refinement.enabled=true"
    echo "$recording.live fusion map \$i/$recording --out out --set live.enabled=true"
    echo "$recording.depth fusion depth \$i/$recording --t0 +0.05 --duration 0.1 --out out --save-dsi --set dsi.num_planes=40"
    echo "$recording.info fusion info \$i/$recording"
    echo "$recording.perturbed fusion map \$i/$recording --perturb noise_m=0.02,latency_s=0.01,drop=0.1,seed=3 --out out"
  done
  for recording in desk trinocular; do
    echo "$recording.evaluate fusion map \$i/$recording -q --out out
      fusion evaluate depth out \$i/$recording --json
      fusion evaluate map out \$i/$recording --json --to-find \$i/$recording/gt_edges.ply
      fusion evaluate trajectory out/trajectory.txt \$i/$recording/poses.txt --json" | tr '\n' ';'
    echo
  done
  echo 'desk.rawlog fusion import $i/desk --out r.rawlog; fusion info r.rawlog; fusion map r.rawlog --out out
    echo "[none]" > host.ini; host host.ini "" r.rawlog saved
    for to in folder mcap; do fusion export r.rawlog --to $to --t1 1.5 --out e_$to; done' | tr '\n' ';'
  echo
  # What replaces parts of the rig: by options, in playback and live, of a folder and of a rawlog.
  echo 'desk.offsets offsets="--set rig.time_offsets_s=0,0.004"
    fusion map $i/desk --out out $offsets; fusion map $i/desk --out live $offsets --set live.enabled=true
    fusion depth $i/desk $offsets --t0 +0.5 --duration 0.2 --out depth
    fusion map $i/desk --out refined $offsets --set refinement.enabled=true' | tr '\n' ';'
  echo
  echo 'desk.hand_eye echo "T_body_rig: [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, -0.1], [0, 0, 0, 1]]" > hand_eye.yaml
    fusion map $i/desk --out out --hand-eye hand_eye.yaml; fusion info $i/desk --hand-eye hand_eye.yaml
    fusion map $i/desk --out set --set rig.hand_eye=hand_eye.yaml --set live.enabled=true
    fusion import $i/desk --hand-eye hand_eye.yaml --out r.rawlog; fusion map r.rawlog --out of_rawlog
    fusion map r.rawlog --out of_both --hand-eye hand_eye.yaml
    fusion map $i/desk --out perturbed --hand-eye hand_eye.yaml --perturb tracker=typical,seed=2' | tr '\n' ';'
  echo
  echo 'desk.cameras fusion map $i/desk --out out --set rig.cameras=1; fusion map $i/desk --out live --set rig.cameras=1 --set live.enabled=true
    fusion map $i/desk --out reference --set rig.cameras=1 --set dsi.reference_camera=0
    sed "s/resolution: .*/resolution: [346, 260]/; s/intrinsics: \\[\\([0-9.]*\\)/intrinsics: [20\\1/" $i/desk/camchain.yaml > other.yaml
    fusion map $i/desk --out calibrated --calibration $i/desk/camchain.yaml; fusion map $i/desk --out other --calibration other.yaml
    fusion map $i/desk --out set --set rig.calibration=other.yaml; fusion info $i/desk --calibration other.yaml
    fusion map $i/trinocular --out pair --set rig.cameras=0,2 --set dsi.reference_camera=1
    fusion map $i/desk/cam1/events.txt --poses $i/desk/poses.txt --calibration $i/desk/camchain.yaml --set rig.cameras=1 --out one' | tr '\n' ';'
  echo
  while read -r name needs sources; do
    local arguments='' source
    for source in $sources; do arguments+=" \$i/formats/$source"; done
    [[ $needs != *c* ]] || arguments+=" --calibration \$i/piece/camchain.yaml"
    [[ $needs != *p* ]] || arguments+=" --poses \$i/piece/poses.txt"
    echo "$name fusion info $arguments; fusion map $arguments --out out --set keyframes.window_s=0.1
      fusion map $arguments --out paper --config $root/config/paper.ini
      fusion map $arguments --out refined --set keyframes.window_s=0.1 --set refinement.enabled=true
      fusion map $arguments --out live --set keyframes.window_s=0.1 --set live.enabled=true
      fusion depth $arguments --t0 1.45 --t1 1.6 --out depth --save-dsi --set dsi.num_planes=20
      fusion import $arguments --compression zstd --out r.rawlog
      fusion export $arguments --to mcap --out r.mcap" | tr '\n' ';'
    echo
  done <<'FORMATS'
csv - text/csv
gz - text/gz
zip - text/zip
evimo2 cp evimo2/left_camera/sfm/eval/scene_00 evimo2/right_camera/sfm/eval/scene_00
numpy cp numpy/metavision/cam0.npy numpy/fields/cam1.npy
e2vid cp hdf5/e2vid/left.h5 hdf5/e2vid/right.h5
dsec cp hdf5/dsec
tum_vie cp hdf5/tum_vie
m3ed cp hdf5/m3ed/desk_data.h5
mvsec cp hdf5/mvsec/desk_data.hdf5
metavision cp hdf5/metavision/left.h5 hdf5/metavision/right.h5
evt2 cp raw/evt2/cam0.raw raw/evt2/cam1.raw
evt21 cp raw/evt21/cam0.raw raw/evt21/cam1.raw
evt3 cp raw/evt3/cam0.raw raw/evt3/cam1.raw
aedat4 cp aedat4/lz4.aedat4
bag_dvs c ros1_bag/dvs.bag
bag_evt3 c ros1_bag/evt3_bz2.bag
db3 c ros2_bag/mono.db3
mcap c ros2_bag/evt3.mcap
FORMATS
}

# run_jobs BIN OUT: each job in OUT/<name>, with what it printed.
run_jobs() {
  local bin=$1 out=$2 name commands
  fusion() { program "$bin" "$@" || echo "exit status $?"; }
  host() {
    LD_LIBRARY_PATH="$bin/../lib" "$bin/mrpt_host" "$bin/../lib/libmrpt-event-fusion.so" "$@" || echo "exit status $?"
  }
  # shellcheck disable=SC2034  # the commands of the table use it
  local i=$in
  while read -r name commands; do
    mkdir -p "$out/$name"
    cd "$out/$name"
    eval "$commands" > stdout.txt 2> stderr.txt < /dev/null
  done < "$work/jobs"
}

program "$old" --version > /dev/null
program "$new" --version > /dev/null
[ -d "$in" ] || make_recordings
rm -rf "$work/old" "$work/new"
jobs_table | grep -E "${quick:-.}" > "$work/jobs"
run_jobs "$old" "$work/old" &
trap 'kill $! 2> /dev/null || true' EXIT
run_jobs "$new" "$work/new"
wait $!

python3 - "$work" "$old" "$new" <<'PYTHON'
"""Compares two folders of results, file by file."""
import json
import pathlib
import re
import sys

WORK = pathlib.Path(sys.argv[1])
VOLATILE = {"seconds", "cpu_seconds", "votes_per_second", "peak_memory_bytes", "version", "session"}
TIMES = re.compile(r"(?m)^time +[\d.]+ s for |; at most \d+ [MG]B of memory|(?<=; sweep )[\d.]+ s, depth [\d.]+ s, "
                   r"(?:motion [\d.]+ s, )?refinement [\d.]+ s|^\[\d\d:\d\d:[\d.]+|^event-fusion: [a-z ]+\d+ %, .*$")
EXPECTED_FAILURES = {"version"}  # one of its commands does not exist
EMBEDDED = re.compile(r'(application/json">)(.*?)(</script>)', re.S)


def lasting(value):
    """The JSON value without what depends on time and memory."""
    if isinstance(value, dict):
        return {k: lasting(v) for k, v in value.items() if k not in VOLATILE}
    return [lasting(v) for v in value] if isinstance(value, list) else value


def pixels(path):
    try:
        import cv2
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        return image.shape, image.dtype, image.tobytes()
    except ImportError:
        return path.read_bytes()


def content(side, name):
    path = WORK / side / name
    if path.suffix in (".png", ".tiff"):
        return pixels(path)
    if path.name == "session.mcap":  # it holds the report, and other files show its keyframes
        return b""
    if path.suffix not in (".txt", ".json", ".html", ".ini", ".yaml"):
        return path.read_bytes()
    text = path.read_text().replace(f"{WORK}/{side}/", "")
    if path.suffix == ".json":
        return json.dumps(lasting(json.loads(text)))
    if path.suffix == ".html":
        return EMBEDDED.sub(lambda part: str(lasting(json.loads(part[2]))), text)
    return TIMES.sub("T", text) if path.stem in ("stdout", "stderr") else text


def files(side):
    return {str(p.relative_to(WORK / side)) for p in (WORK / side).rglob("*") if p.is_file()}


old, new = files("old"), files("new")
different = [f"only in {side}: {name}" for side, names in (("old", old - new), ("new", new - old)) for name in sorted(names)]
for name in sorted(old & new):
    if (WORK / "old" / name).read_bytes() != (WORK / "new" / name).read_bytes() and content("old", name) != content("new", name):
        different.append(f"differs: {name}")
failed = [str(path.parent.name) for path in sorted((WORK / "new").glob("*/stdout.txt"))
          if "exit status " in path.read_text() and path.parent.name not in EXPECTED_FAILURES]
different += [f"fails: {name}" for name in failed]
print("\n".join(different))
print(f"{len(old | new)} files, {sum(name.endswith('.pcd') for name in new)} of them maps, of "
      f"{sum(1 for _ in (WORK / 'jobs').open())} jobs: "
      + (f"{len(different)} differ or fail; see {WORK}/old and new" if different else "equal"))
sys.exit(1 if different else 0)
PYTHON
