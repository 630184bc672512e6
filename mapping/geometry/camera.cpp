// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/camera.h"

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "mapping/base/named_choice.h"
#include "mapping/base/option_check.h"

namespace efm {
namespace {

constexpr NamedChoice<DistortionModel> kDistortionModels[] = {
    {DistortionModel::kNone, "none"},
    {DistortionModel::kRadtan, "radtan"},
    {DistortionModel::kEquidistant, "equidistant"},
};

struct CoefficientCount {
  bool allowed;
  const char* expected;
};

CoefficientCount checkCoefficientCount(DistortionModel model, std::size_t count) {
  switch (model) {
    case DistortionModel::kNone:
      return {count == 0, "0 for distortion model none"};
    case DistortionModel::kRadtan:
      return {count == 4 || count == 5, "4 or 5 (k1 k2 p1 p2 [k3]) for distortion model radtan"};
    case DistortionModel::kEquidistant:
      return {count == 4, "4 (k1 k2 k3 k4) for distortion model equidistant"};
  }
  return {false, "a known distortion model"};
}

}  // namespace

std::string_view nameOf(DistortionModel model) { return nameIn(kDistortionModels, model); }
DistortionModel distortionModelFromName(std::string_view name) {
  return valueIn(kDistortionModels, name);
}

void CameraModel::validate() const {
  constexpr int kMaxSide = std::numeric_limits<std::uint16_t>::max();
  requireOption(width >= 1 && width <= kMaxSide, "width", width, "1 to 65535");
  requireOption(height >= 1 && height <= kMaxSide, "height", height, "1 to 65535");
  requireOption(std::isfinite(fx) && fx > 0, "fx", fx, "finite and above 0");
  requireOption(std::isfinite(fy) && fy > 0, "fy", fy, "finite and above 0");
  requireOption(std::isfinite(cx), "cx", cx, "finite");
  requireOption(std::isfinite(cy), "cy", cy, "finite");
  const CoefficientCount count = checkCoefficientCount(distortion, coefficients.size());
  requireOption(count.allowed, "number of distortion coefficients", coefficients.size(),
                count.expected);
  for (const double coefficient : coefficients) {
    requireOption(std::isfinite(coefficient), "distortion coefficient", coefficient, "finite");
  }
}

Eigen::Vector2d CameraModel::project(const Eigen::Vector3d& p_cam) const {
  const std::vector<cv::Point3d> points = {{p_cam.x(), p_cam.y(), p_cam.z()}};
  const cv::Vec3d no_motion(0, 0, 0);
  const cv::Matx33d intrinsics(fx, 0, cx, 0, fy, cy, 0, 0, 1);
  std::vector<cv::Point2d> pixels;
  if (distortion == DistortionModel::kEquidistant) {
    cv::fisheye::projectPoints(points, pixels, no_motion, no_motion, intrinsics, coefficients);
  } else {
    cv::projectPoints(points, no_motion, no_motion, intrinsics, coefficients, pixels);
  }
  return {pixels.front().x, pixels.front().y};
}

bool operator==(const CameraModel& a, const CameraModel& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion &&
         a.coefficients == b.coefficients;
}

}  // namespace efm
