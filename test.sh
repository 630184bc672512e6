#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds a Release and runs all tests.
set -euo pipefail
cd "$(dirname "$0")"
scripts/install_packages.sh
cmake --preset release
cmake --build --preset release
cmake --build --preset release --target all_verify_interface_header_sets
ctest --preset release "$@"
