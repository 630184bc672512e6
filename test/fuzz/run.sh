#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the fuzzers with clang and runs each for a time. Their findings are written to build/fuzz/findings.
#   run.sh [SECONDS] [NAME ...]    default: 60 seconds each, all fuzzers
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
shift || true
cmake --preset fuzz > /dev/null
cmake --build --preset fuzz
names=("$@")
if [ ${#names[@]} -eq 0 ]; then
  for corpus in test/fuzz/corpus/*; do names+=("$(basename "$corpus")"); done
fi
mkdir -p build/fuzz/findings
for name in "${names[@]}"; do
  echo "$name"
  mkdir -p "build/fuzz/corpus/$name"
  build/fuzz/bin/fuzz_"$name" -max_total_time="$seconds" -rss_limit_mb=2000 -timeout=20 -max_len=65536 \
    -print_final_stats=1 -artifact_prefix="build/fuzz/findings/$name-" \
    "build/fuzz/corpus/$name" "test/fuzz/corpus/$name" 2> "build/fuzz/$name.log" ||
    { tail -n 30 "build/fuzz/$name.log"; exit 1; }
  grep -E "number_of_executed_units|peak_rss_mb" "build/fuzz/$name.log"
done
