// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/rig.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

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

CameraModel cutTo(const SensorArea& area, CameraModel model) {
  const auto cut = [](double binning, double from, double count, int& side, double& f, double& c) {
    binning = std::max(1.0, binning);
    const double whole = count > 0 ? count : side;
    const double pixels = std::floor(whole / binning);
    if (!(from >= 0 && pixels >= 1 && from + whole <= side)) {
      NumberText text(6);
      text << "roi, binning: " << whole << " pixels from " << from << " on, " << binning
           << " in one: expected an area in the sensor's " << side;
      throw std::runtime_error(text.str());
    }
    side = static_cast<int>(pixels);
    f /= binning;
    c = (c - from - (binning - 1) / 2) / binning;  // pixel 0 is the middle of the first ones
  };
  cut(area.binning_x, area.x, area.width, model.width, model.fx, model.cx);
  cut(area.binning_y, area.y, area.height, model.height, model.fy, model.cy);
  return model;
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

void RigCamera::validate() const {
  model.validate();
  constexpr double kMaxRounding = 1e-6;
  const double norm = T_rig_cam.rotation.norm();
  requireOption(std::abs(norm - 1) <= kMaxRounding, "T_rig_cam: length of the rotation quaternion",
                norm, "1");
  const Eigen::Vector3d& at = T_rig_cam.translation;
  requireOption(std::isfinite(at.x()), "T_rig_cam: x", at.x(), "finite (metres)");
  requireOption(std::isfinite(at.y()), "T_rig_cam: y", at.y(), "finite (metres)");
  requireOption(std::isfinite(at.z()), "T_rig_cam: z", at.z(), "finite (metres)");
  requireOption(time_offset_ns >= -kEndOfTimeNs && time_offset_ns <= kEndOfTimeNs, "time offset",
                formatSeconds(time_offset_ns), "within " + formatSeconds(kEndOfTimeNs) + " s");
}

bool isSelected(int camera, const std::vector<int>& selection) {
  return selection.empty() ||
         std::find(selection.begin(), selection.end(), camera) != selection.end();
}

std::vector<int> selectedCameras(const Rig& rig, const std::vector<int>& selection) {
  if (!selection.empty()) return selection;
  std::vector<int> all(rig.cameras.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

}  // namespace efm
