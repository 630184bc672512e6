#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds oneTBB from Debian's source package, instrumented, for the presets tsan and asan. ThreadSanitizer must see how
# tasks wait for each other: otherwise it takes all that a task writes for a race. Without tbbmalloc: AddressSanitizer
# must see where each block of memory ends. Does nothing where the library is there.
#   build_tbb.sh thread|address        into build/tbb-thread or build/tbb-address
set -euo pipefail
sanitizer=${1:?usage: build_tbb.sh thread|address}
root=$(realpath "$(dirname "$0")/../..")
out=$root/build/tbb-$sanitizer
[ -e "$out/lib/libtbb.so.12" ] && exit 0

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/parts" "$work/lists/partial" "$work/cache/archives/partial"
# The sources come from where the packages come from.
for list in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
  [ -e "$list" ] && sed 's/^deb /deb-src /' "$list" >"$work/parts/$(basename "$list" .list)-src.list"
done
for list in /etc/apt/sources.list.d/*.sources; do
  [ -e "$list" ] && sed 's/^Types:.*/Types: deb-src/' "$list" >"$work/parts/$(basename "$list")"
done
apt=(-q -o "Dir::Etc::SourceList=/dev/null" -o "Dir::Etc::SourceParts=$work/parts"
  -o "Dir::State::Lists=$work/lists" -o "Dir::Cache=$work/cache" -o "APT::Sandbox::User=root")
version=$(dpkg-query -W -f='${Version}' libtbb-dev)
cd "$work"
apt-get "${apt[@]}" update >apt.log 2>&1 &&
  apt-get "${apt[@]}" source --download-only "onetbb=$version" >>apt.log 2>&1 || { cat apt.log >&2; exit 1; }
mkdir source
tar xf onetbb_*.orig.tar.* -C source --strip-components=1

cmake -S source -B build -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DTBB_SANITIZE="$sanitizer" \
  -DCMAKE_CXX_FLAGS=-w -DTBB_TEST=OFF -DTBB_STRICT=OFF -DTBBMALLOC_BUILD=OFF \
  -DCMAKE_INSTALL_PREFIX="$out" -DCMAKE_INSTALL_LIBDIR=lib
cmake --build build --parallel 2
cmake --install build >/dev/null
