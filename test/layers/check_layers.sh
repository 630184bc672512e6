#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Compares every #include of the project with the table of layers (CONTRIBUTING.md, "Layers") and
# the table of folders (folders.txt): who may include whom, and which library may appear where. Prints
# each line that breaks them.
#   check_layers.sh ROOT
set -euo pipefail
tables=$(cd "$(dirname "$0")" && pwd)
cd "${1:?usage: check_layers.sh ROOT}"
broken=0

# forbid FOLDER PATTERN WHY [EXCEPT]: no file of the folder includes what matches the pattern,
# except files whose path matches EXCEPT.
forbid() {
  local folder=$1 pattern=$2 why=$3 except=${4:-^$} hits
  [ -d "$folder" ] || return 0
  hits=$(grep -rnE --include='*.h' --include='*.cpp' \
    "^[[:space:]]*#[[:space:]]*include[[:space:]]+[<\"]($pattern)" "$folder" | grep -vE "$except" || true)
  [ -n "$hits" ] || return 0
  printf '%s: %s\n%s\n' "$folder" "$why" "$hits"
  broken=1
}

mrpt='mrpt/'
pcl='pcl/'
ceres='ceres/'
recordings='hdf5|H5|rosbag|ros/'
front='CLI/|yaml-cpp/'

forbid mapping "(maps|tracking_stub|plugin|test)/" "may include mapping/ alone"
forbid mapping "$mrpt|$pcl|$ceres|$recordings|$front" "may use Eigen, OpenCV, oneTBB and Highway"
forbid mapping "hwy/" "Highway stays in mapping/kernels/" '^mapping/kernels/'
forbid mapping "spng\.h|tiff|zlib" "libspng and libtiff stay in picture_file" '^mapping/base/picture_file\.cpp:'
forbid mapping/kernels "Eigen|opencv2|tbb|oneapi" "may use Highway alone"
forbid mapping/kernels "mapping/[^k]" "may include mapping/kernels/ alone"
forbid maps "(tracking_stub|plugin|test)/" "may include mapping/ and maps/"
forbid maps "$mrpt|$recordings|$front" "may use PCL, Ceres and what mapping/ uses"
forbid maps "$ceres" "Ceres stays in one pair of files" '^maps/refinement/pose_refinement\.(h|cpp):'
forbid maps "$pcl" "PCL stays in cloud/, at its point type and its searches" '^maps/cloud/(map_point|cloud_points)\.(h|cpp):'
forbid maps "liblzf" "liblzf stays in pcd_file" '^maps/io/pcd_file\.cpp:'
forbid tracking_stub "(maps|plugin|test)/" "may include mapping/ and tracking_stub/"
forbid tracking_stub "$mrpt|$pcl|$ceres|$recordings|$front" "may use what mapping/ uses"
for folder in mapping maps tracking_stub plugin; do
  forbid "$folder" "opencv2/(imgcodecs|highgui|opencv\.hpp)" "pictures go through mapping/base/picture_file" \
    '^plugin/mrpt/CEventFusionMapBuilder\.cpp:'
done
for folder in maps tracking_stub plugin; do
  forbid "$folder" "spng\.h|tiff" "libspng and libtiff stay in mapping/base/picture_file"
done
forbid plugin "(test|plugin/app)/" "never includes the application or the tests" '^plugin/app/'
forbid plugin "$pcl" "PCL stays in maps/ (map_point.h is its header) and cloud_alignment" '^plugin/evaluation/cloud_alignment\.cpp:'
forbid plugin "$ceres" "refinement is reached through maps/"
forbid plugin "$recordings" "HDF5 stays in plugin/recordings/columns/ and writers/" '^plugin/recordings/(columns|writers)/'

forbid include "$mrpt|$ceres|$recordings|$front|pcl/|tbb|nlohmann|fmt/" "the public header: Eigen, OpenCV, PCL by map_point.h"
forbid plugin/recordings "maps/" "knows no map: a library of its own, over mapping/ and tracking_stub/"
forbid plugin "$mrpt" "MRPT stays in mrpt/" '^plugin/mrpt/'
forbid python "(test|plugin/app|plugin/mrpt)/" "a thin face: the engine alone"
forbid python "$mrpt|$pcl|$ceres|$recordings|$front|nlohmann|tbb" "may use pybind11 and what the engine's headers use"
for folder in mapping maps tracking_stub plugin include; do
  forbid "$folder" "pybind11" "pybind11 stays in python/"
done

# Every folder is in the table, and includes only the folders that the table allows it.
folders=$(awk '
  function folder_of(path) { sub(/\/[^\/]*$/, "", path); return path }
  function top_of(path) { sub(/\/.*/, "", path); return path }
  FNR == NR {
    if ($0 ~ /^#/ || NF == 0) next
    folder = $1; sub(/:$/, "", folder)
    top = top_of(folder)
    known[folder] = 1
    for (i = 2; i <= NF; ++i) {
      if ($i != "*") { allowed[folder, top "/" $i] = 1; continue }
      for (other in known) if (index(other, top "/") == 1) allowed[folder, other] = 1
    }
    next
  }
  {
    split($0, parts, ":")
    folder = folder_of(parts[1])
    match($0, /"[^"]+"/)
    other = folder_of(substr($0, RSTART + 1, RLENGTH - 2))
    if (!(folder in known)) print $0 ": " folder " is no folder of folders.txt"
    else if (top_of(other) == top_of(folder) && folder != other && !((folder, other) in allowed))
      print $0 ": " folder " may not include " other
  }' "$tables/folders.txt" <(grep -rnE --include='*.h' --include='*.cpp' \
    '^[[:space:]]*#[[:space:]]*include[[:space:]]+"' mapping maps tracking_stub plugin))
if [ -n "$folders" ]; then
  printf 'folders:\n%s\n' "$folders"
  broken=1
fi

if [ "$broken" -ne 0 ]; then
  echo "the layers are broken" >&2
  exit 1
fi
echo "the layers hold"
