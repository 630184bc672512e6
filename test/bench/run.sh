#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the benchmarks and writes DIR/performance.csv and DIR/performance.md. Builds nothing.
#   run.sh [--quick] [--build DIR] [--out DIR] [GROUP ...] [--benchmark_...]
# --quick     each case once and small: tests that everything runs. Its times mean nothing
# --build     the build folder. Default: build/release
# --out       Default: build/bench
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$root/build/release
out=$root/build/bench
rest=()
while [ $# -gt 0 ]; do
  case $1 in
    --build) build=${2:?--build: expected a folder}; shift ;;
    --out) out=${2:?--out: expected a folder}; shift ;;
    *) rest+=("$1") ;;
  esac
  shift
done
bench=$build/bin/event_fusion_bench
if [ ! -x "$bench" ]; then
  echo "$bench is not there: build it with cmake --preset release && cmake --build --preset release" >&2
  exit 1
fi
commit=$(git -C "$root" describe --always --dirty 2>/dev/null || echo unknown)
exec "$bench" --out "$out" --commit "$commit" "${rest[@]}"
