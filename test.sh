#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds a Release and runs the tests. Arguments after the first go to ctest.
#   test.sh [CTEST ARGUMENT…]        what every change must pass
#   test.sh long [CTEST ARGUMENT…]   the long tests, the benchmarks, the studies; each header compiled alone
set -euo pipefail
cd "$(dirname "$0")"
scripts/install_packages.sh all
if [ "${1:-}" = long ]; then
  shift
  cmake --preset release -DEFM_BUILD_TESTS=ON -DEFM_BUILD_LONG=ON
  cmake --build --preset release
  cmake --build --preset release --target all_verify_interface_header_sets
  ctest --preset release --label-regex long "$@"
else
  cmake --preset release -DEFM_BUILD_TESTS=ON -DEFM_BUILD_LONG=OFF
  cmake --build --preset release
  ctest --preset release --label-exclude long "$@"
fi
