#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Compiles every kernel file for 64-bit Arm, where Highway's vectors are NEON's. Exits with 77, which
# ctest takes for "skipped", where there is no cross compiler (Debian: g++-aarch64-linux-gnu).
#   compile_for_neon.sh ROOT HIGHWAY_INCLUDE_FOLDER
set -euo pipefail
usage='usage: compile_for_neon.sh ROOT HIGHWAY_INCLUDE_FOLDER'
root=${1:?$usage}
highway=${2:?$usage}
compiler=${NEON_CXX:-aarch64-linux-gnu-g++}

if ! command -v "$compiler" > /dev/null; then
  echo "skipped: there is no $compiler"
  exit 77
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Highway's headers alone: its folder may hold those of another architecture too.
mkdir "$work/include"
ln -s "$highway/hwy" "$work/include/hwy"

for file in "$root"/mapping/kernels/*.cpp; do
  object=$work/$(basename "$file" .cpp).o
  "$compiler" -std=c++17 -O2 -Wall -Wextra -Wpedantic -Wshadow -Werror \
    -isystem "$work/include" -I "$root" -c "$file" -o "$object"
  echo "compiled: ${file#"$root"/}"
done
