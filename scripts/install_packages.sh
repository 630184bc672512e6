#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the Debian packages of packages.txt that are missing. Needs root only where some are.
#   install_packages.sh       what building, the demo and the Python module need
#   install_packages.sh all   what tests need, too
set -euo pipefail
list="$(dirname "$0")/../packages.txt"

missing=()
while read -r package; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done < <(if [ "${1:-}" = all ]; then cat "$list"; else sed '/^# == Tests/,$d' "$list"; fi |
  grep -vE '^[[:space:]]*(#|$)')

if [ "${#missing[@]}" -eq 0 ]; then exit 0; fi
if [ "$(id -u)" -ne 0 ]; then
  echo "these packages are missing, run as root or install them: ${missing[*]}" >&2
  exit 1
fi
echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { apt-get update -q && apt-get install -y -q --no-install-recommends "${missing[@]}"; } \
    >"$log" 2>&1; then
  tail -n 30 "$log" >&2
  echo "the packages could not be installed" >&2
  exit 1
fi
