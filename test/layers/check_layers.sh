#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Holds every #include of the project against the table of layers (CONTRIBUTING.md, "Layers"):
# who may include whom, and which library may appear where. Prints each line that breaks it.
#   check_layers.sh ROOT
set -euo pipefail
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
forbid mapping/kernels "Eigen|opencv2|tbb|oneapi" "may use Highway alone"
forbid mapping/kernels "mapping/[^k]" "may include mapping/kernels/ alone"
forbid maps "(tracking_stub|plugin|test)/" "may include mapping/ and maps/"
forbid maps "$mrpt|$recordings|$front" "may use PCL, Ceres and what mapping/ uses"
forbid maps "$ceres" "Ceres stays in one pair of files" '^maps/pose_refinement\.(h|cpp):'
forbid tracking_stub "(maps|plugin|test)/" "may include mapping/ and tracking_stub/"
forbid tracking_stub "$mrpt|$pcl|$ceres|$recordings|$front" "may use what mapping/ uses"
forbid plugin "(test|plugin/app)/" "never includes the application or the tests" '^plugin/app/'
forbid plugin "$ceres" "refinement is reached through maps/"
forbid plugin "$recordings" "HDF5 and ROS bags stay in plugin/datasets/" '^plugin/datasets/'

if [ "$broken" -ne 0 ]; then
  echo "the layers are broken" >&2
  exit 1
fi
echo "the layers hold"
