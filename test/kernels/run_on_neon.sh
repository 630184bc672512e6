#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Compiles every kernel file for 64-bit Arm, where Highway's vectors are NEON's, and runs the kernels'
# self-test in an emulator. Exits with 77, which ctest takes for "skipped", where there is no cross
# compiler or no emulator (Debian: g++-aarch64-linux-gnu, qemu-user).
#   run_on_neon.sh ROOT HIGHWAY_INCLUDE_FOLDER
set -euo pipefail
usage='usage: run_on_neon.sh ROOT HIGHWAY_INCLUDE_FOLDER'
root=${1:?$usage}
highway=${2:?$usage}
compiler=${NEON_CXX:-aarch64-linux-gnu-g++}
emulator=${NEON_EMULATOR:-qemu-aarch64}

for tool in "$compiler" "$emulator"; do
  if ! command -v "$tool" > /dev/null; then
    echo "skipped: there is no $tool"
    exit 77
  fi
done

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Highway's headers alone: its folder may hold those of another architecture too.
mkdir "$work/include"
ln -s "$highway/hwy" "$work/include/hwy"

# As in mapping/CMakeLists.txt, products are rounded before they are added.
flags=(-std=c++17 -O2 -ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Werror -isystem "$work/include" -I "$root")
objects=()
for file in "$root"/mapping/kernels/*.cpp "$root"/test/kernels/self_test{,_main}.cpp; do
  object=$work/$(basename "$file" .cpp).o
  "$compiler" "${flags[@]}" -c "$file" -o "$object"
  objects+=("$object")
done
"$compiler" -static "${objects[@]}" -o "$work/self_test"
"$emulator" "$work/self_test" neon
