#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs a build, builds the examples against what was installed, in another folder, and runs them: the maps are
# the same, bit for bit, by the program, by the engine, by MRPT's builder and in Python.
#   install_test.sh BUILD RECORDING WORK     BUILD has the project, RECORDING a folder that `map` reads
set -euo pipefail
build=$(realpath "$1") recording=$(realpath "$2")
source=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$build/CMakeCache.txt")
rm -rf "$3"
mkdir -p "$3"
cd "$3"
fail() { echo "$*" >&2; exit 1; }

cmake --install "$build" --prefix prefix >install.log
pc=$(find "$PWD/prefix" -name event-fusion-mapper.pc)
libraries=$(realpath "$(dirname "$pc")/..")
version=$(sed -n 's/^Version: //p' "$pc")
cp -r prefix/share/event-fusion-mapper/examples .
cmake -S examples -B build -DCMAKE_PREFIX_PATH="$PWD/prefix" -DCMAKE_BUILD_TYPE=Release >configure.log
cmake --build build -j2 >build.log

sed -n '/^```cpp$/,/^```$/{/^```/d;p}' "$(find prefix -name README.md)" >readme.cpp
! grep -vxFf examples/own_data.cpp readme.cpp || fail "these lines of README are not in own_data.cpp"

program=prefix/bin/event-fusion
[ "$($program --version | head -n 1)" = "event-fusion $version" ] || fail "the program has another version than $version"
$program map -q "$recording" --out out
$program import -q "$recording" --out recording.rawlog
build/map_recording example_out "$recording" >/dev/null
build/own_data "$recording" "$recording/poses.txt" >own.log
build/mrpt_host recording.rawlog >/dev/null
for map in example_out/map.pcd own.pcd mrpt.pcd; do
  cmp out/map.pcd $map || fail "$map is not the program's map"
done
[ "$(grep -c '^keyframe at .*[1-9][0-9]* depths$' own.log)" = "$(find out/keyframes -mindepth 1 -maxdepth 1 | wc -l)" ] ||
  fail "own_data delivers other keyframes"
build/live "$recording" >live.log
grep -q '^[1-9][0-9]* keyframes, [1-9][0-9]* points in live.pcd, ' live.log || fail "live: $(tail -n 1 live.log)"
cp prefix/share/event-fusion-mapper/config/simulated_stereo.ini prefix/share/event-fusion-mapper/config/only_here.ini
$program map -q "$recording" --config only_here --out by_name || fail "the installed option files are not found"

# Another minor version is another interface. An unknown component is named.
request() {  # ARGUMENTS of find_package
  mkdir -p request
  printf 'cmake_minimum_required(VERSION 3.25)\nproject(request CXX)\nfind_package(event-fusion-mapper %s REQUIRED)\n' "$1" >request/CMakeLists.txt
  cmake -S request -B request/build -DCMAKE_PREFIX_PATH="$PWD/prefix" >request.log 2>&1
}
request "${version%.*}" || fail "version ${version%.*} is not found"
for wrong in 0.1 0.99 1.0; do
  ! request $wrong || fail "version $version is taken for $wrong"
  grep -q "event-fusion-mapper-config.cmake, version: $version" request.log || fail "$(tail -n 9 request.log)"
done
! request "COMPONENTS gui" || fail "component gui is found"
grep -q 'There is no component gui' request.log || fail "$(tail -n 5 request.log)"

# Without CMake.
flags=$(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --cflags --libs event-fusion-mapper)
# shellcheck disable=SC2086
c++ examples/map_recording.cpp -o by_pkg_config $flags -Wl,-rpath,"$libraries" || fail "pkg-config: $flags"
ldd by_pkg_config >ldd.txt
grep -q "libevent-fusion.so.* => $libraries" ldd.txt || fail "pkg-config gives another library: $(cat ldd.txt)"
ldd "$libraries/libevent-fusion.so" >ldd.txt
! grep mrpt ldd.txt || fail "the engine needs MRPT"

# Python's package: installed below the prefix, and by pip as a wheel, which needs no network.
python=$(sed -n 's/^EFM_PYTHON_DIR:STRING=//p' "$build/CMakeCache.txt")
if [ -n "$python" ]; then
  cat >map.py <<'END'
import sys
import event_fusion as ef
ef.map(ef.open(sys.argv[1])).save(sys.argv[2])
ef.Mapper("only_here" if len(sys.argv) > 3 else "simulated_stereo")  # the option files are found by their names
END
  PYTHONPATH=prefix/$python /usr/bin/python3 map.py "$recording" python.pcd only_here || fail "the installed package does not map"
  /usr/bin/python3 -m venv --system-site-packages env
  EFM_BUILD=$build env/bin/pip install --no-index --quiet "$source" || fail "pip does not install the package"
  mv prefix away  # the wheel has the engine
  env/bin/python map.py "$recording" wheel.pcd || fail "the wheel does not map"
  mv away prefix
  for map in python.pcd wheel.pcd; do
    cmp out/map.pcd $map || fail "$map is not the program's map"
  done
fi

# What was installed needs neither the source tree nor the build tree.
! grep -rl -e "$build" -e "$source" --include='*.cmake' --include='*.pc' --include='*.h' prefix || fail "the package has paths of the build"
echo passed
