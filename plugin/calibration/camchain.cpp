// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/calibration/camchain.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/options/quoted_text.h"
#include "plugin/calibration/yaml_entry.h"

namespace efm {
namespace {

int sideOf(double value, const YamlEntry& entry) {
  if (std::floor(value) == value && value >= 1 && value <= 65535) return static_cast<int>(value);
  throw entry.failKey("resolution", fmt::format("{:g}", value), "whole numbers from 1 to 65535");
}

CameraModel readModel(const YamlEntry& entry) {
  const std::string kind = entry.text("camera_model");
  if (kind != "pinhole") throw entry.failKey("camera_model", inQuotes(kind), "pinhole");

  CameraModel model;
  const std::vector<double> intrinsics = entry.numbers("intrinsics", 4, "4, fx fy cx cy");
  model.fx = intrinsics[0];
  model.fy = intrinsics[1];
  model.cx = intrinsics[2];
  model.cy = intrinsics[3];
  const std::vector<double> resolution = entry.numbers("resolution", 2, "2, width height");
  model.width = sideOf(resolution[0], entry);
  model.height = sideOf(resolution[1], entry);
  const std::string distortion = entry.text("distortion_model");
  try {
    model.distortion = distortionModelFromName(distortion);
  } catch (const std::invalid_argument&) {
    throw entry.failKey("distortion_model", inQuotes(distortion), "radtan, equidistant or none");
  }
  if (model.distortion != DistortionModel::kNone || entry.has("distortion_coeffs")) {
    model.coefficients = entry.numbers("distortion_coeffs", 0, "a list of numbers");
  }
  try {
    model.validate();
  } catch (const std::invalid_argument& error) {
    throw entry.fail(error.what());
  }
  return model;
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
  Rig rig;
  for (std::size_t n = 0; n < count; ++n) {
    const std::string name = fmt::format("cam{}", n);
    const YamlEntry entry(file.string(), name, root[name]);
    RigCamera camera;
    camera.model = readModel(entry);
    if (n > 0) {
      const Rigid3 T_cn_cnm1 = entry.transform("T_cn_cnm1");
      camera.T_rig_cam = rig.cameras[n - 1].T_rig_cam * T_cn_cnm1.inverse();
    }
    rig.cameras.push_back(camera);
  }
  return rig;
}

}  // namespace efm
