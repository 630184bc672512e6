// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/camchain.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/calibration/camera_entry.h"
#include "plugin/recordings/calibration/yaml_entry.h"

namespace efm {
namespace {

/// The camera's clock: t_imu = t_cam + timeshift_cam_imu.
std::int64_t timeShiftOf(const YamlEntry& entry) {
  constexpr const char* kKey = "timeshift_cam_imu";
  const std::string text = entry.text(kKey);
  const std::optional<std::int64_t> shift_ns = parseSeconds(text);
  if (shift_ns && std::abs(*shift_ns) < kEndOfTimeNs) return *shift_ns;
  throw entry.failKey(kKey, inQuotes(text), "a time in seconds");
}

/// Whether a key is "camN" with a number N.
bool isCameraName(const std::string& name) {
  return name.size() > 3 && name.compare(0, 3, "cam") == 0 &&
         name.find_first_not_of("0123456789", 3) == std::string::npos;
}

/// The number of cameras: cam0, cam1, … without gaps.
std::size_t countCameras(const std::string& file, const YAML::Node& root) {
  std::set<std::string> names;
  if (root.IsMap()) {
    for (const auto& entry : root) {
      if (entry.first.IsScalar() && isCameraName(entry.first.Scalar())) {
        names.insert(entry.first.Scalar());
      }
    }
  }
  if (names.count("cam0") == 0) {
    throw std::runtime_error(file + ": cam0 is missing: expected a camera chain as Kalibr has it");
  }
  std::size_t count = 0;
  while (names.erase(fmt::format("cam{}", count)) > 0) ++count;
  if (!names.empty()) {
    throw std::runtime_error(
        fmt::format("{}: {} without cam{}: expected cameras numbered from cam0 without gaps", file,
                    *names.begin(), count));
  }
  return count;
}

}  // namespace

Rig readCamchain(const std::filesystem::path& file) {
  const YAML::Node root = loadYaml(file.string());
  const std::size_t count = countCameras(file.string(), root);
  std::vector<std::int64_t> shifts_ns;
  Rig rig;
  for (std::size_t n = 0; n < count; ++n) {
    const std::string name = fmt::format("cam{}", n);
    const YamlEntry entry(file.string(), name, root[name]);
    RigCamera camera;
    camera.model = readKalibrCamera(entry, "intrinsics");
    if (n > 0) {
      const Rigid3 T_cn_cnm1 = entry.transform("T_cn_cnm1");
      camera.T_rig_cam = rig.cameras[n - 1].T_rig_cam * T_cn_cnm1.inverse();
    }
    if (entry.has("timeshift_cam_imu") || !shifts_ns.empty()) {
      if (shifts_ns.size() != n) {
        throw entry.fail("timeshift_cam_imu: expected for all cameras, or for none");
      }
      shifts_ns.push_back(timeShiftOf(entry));
      camera.time_offset_ns = shifts_ns[n] - shifts_ns[0];
    }
    rig.cameras.push_back(camera);
  }
  return rig;
}

std::optional<Rigid3> readCamchainImu(const std::filesystem::path& file) {
  constexpr const char* kKey = "T_cam_imu";
  const YAML::Node root = loadYaml(file.string());
  countCameras(file.string(), root);
  const YamlEntry cam0(file.string(), "cam0", root["cam0"]);
  if (!cam0.has(kKey)) return std::nullopt;
  return cam0.transform(kKey).inverse();
}

}  // namespace efm
