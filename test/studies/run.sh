#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the studies and writes docs/studies.md and docs/studies/*.png.
#   run.sh [--quick] [--build DIR] [--out DIR] [--cache DIR] [NAME ...]
# --quick   tiny, into a temporary folder: tests that every study runs
# --build   the build folder. Default: build/release, which is then built
# --out     Default: docs
# --cache   simulated events. Default: build/studies_cache
# NAME      studies. Default: all
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
build=
out=$root/docs
cache=$root/build/studies_cache
quick=no
names=()
while [ $# -gt 0 ]; do
  case $1 in
    --quick) quick=yes ;;
    --build) build=${2:?--build: expected a folder}; shift ;;
    --out) out=${2:?--out: expected a folder}; shift ;;
    --cache) cache=${2:?--cache: expected a folder}; shift ;;
    *) names+=("$1") ;;
  esac
  shift
done
if [ -z "$build" ]; then
  build=$root/build/release
  (cd "$root" && cmake --preset release >/dev/null)
  cmake --build "$build" --target event_fusion_studies
fi
studies=$build/bin/event_fusion_studies
if [ "$quick" = yes ]; then
  scratch=$(mktemp -d)
  trap 'rm -rf "$scratch"' EXIT
  "$studies" --quick --out "$scratch" --cache "$scratch/cache" "${names[@]}"
  exit
fi
exec "$studies" --out "$out" --cache "$cache" "${names[@]}"
