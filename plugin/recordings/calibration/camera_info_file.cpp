// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/camera_info_file.h"

#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "plugin/recordings/calibration/camera_entry.h"

namespace efm {

CameraModel readCameraInfo(const YamlEntry& root) {
  constexpr const char* kForm = "9, fx 0 cx 0 fy cy 0 0 1";
  const YamlEntry matrix = root.section("camera_matrix");
  const std::vector<double> k = matrix.numbers("data", 9, kForm);
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    throw matrix.failKey("data", "a matrix with skew or another last row", kForm);
  }
  CameraModel model;
  model.fx = k[0];
  model.cx = k[2];
  model.fy = k[4];
  model.cy = k[5];
  const double width = root.number("image_width");
  setSensorSize(root, "image_width", width, 1, model);
  setSensorSize(root, "image_height", width, root.number("image_height"), model);

  const std::string distortion = root.text("distortion_model");
  if (distortion == "plumb_bob") {
    model.distortion = DistortionModel::kRadtan;
  } else if (distortion == "equidistant" || distortion == "fisheye") {
    model.distortion = DistortionModel::kEquidistant;
  } else {
    throw root.failKey("distortion_model", inQuotes(distortion),
                       "plumb_bob, equidistant or fisheye");
  }
  model.coefficients =
      root.section("distortion_coefficients").numbers("data", 0, "a list of numbers");
  requireValid(root, model);
  return model;
}

}  // namespace efm
