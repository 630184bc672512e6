// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/camera_entry.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/text.h"

namespace efm {

CameraModel readKalibrCamera(const YamlEntry& entry, const char* intrinsics_key) {
  const std::string kind = entry.text("camera_model");
  if (kind != "pinhole") throw entry.failKey("camera_model", inQuotes(kind), "pinhole");

  CameraModel model;
  const std::vector<double> intrinsics = entry.numbers(intrinsics_key, 4, "4, fx fy cx cy");
  model.fx = intrinsics[0];
  model.fy = intrinsics[1];
  model.cx = intrinsics[2];
  model.cy = intrinsics[3];
  const std::vector<double> resolution = entry.numbers("resolution", 2, "2, width height");
  setSensorSize(entry, "resolution", resolution[0], resolution[1], model);
  const std::string distortion = entry.text("distortion_model");
  try {
    model.distortion = distortionModelFromName(distortion);
  } catch (const std::invalid_argument&) {
    throw entry.failKey("distortion_model", inQuotes(distortion), "radtan, equidistant or none");
  }
  if (model.distortion != DistortionModel::kNone || entry.has("distortion_coeffs")) {
    model.coefficients = entry.numbers("distortion_coeffs", 0, "a list of numbers");
  }
  requireValid(entry, model);
  return model;
}

void setSensorSize(const YamlEntry& entry, const char* key, double width, double height,
                   CameraModel& model) {
  for (const double side : {width, height}) {
    if (std::floor(side) == side && side >= 1 && side <= 65535) continue;
    throw entry.failKey(key, fmt::format("{:g}", side), "whole numbers from 1 to 65535");
  }
  model.width = static_cast<int>(width);
  model.height = static_cast<int>(height);
}

void requireValid(const YamlEntry& entry, const CameraModel& model) {
  try {
    model.validate();
  } catch (const std::invalid_argument& error) {
    throw entry.fail(error.what());
  }
}

}  // namespace efm
