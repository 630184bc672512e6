// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "mapping/geometry/undistortion.h"

namespace efm::camera_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

CameraModel davis346(DistortionModel distortion, std::vector<double> coefficients) {
  return {346, 260, 226.38, 226.15, 173.65, 133.73, distortion, std::move(coefficients)};
}

/// Real lenses: a DAVIS240C's, once without k3, and a DAVIS346's fisheye.
std::vector<CameraModel> realLenses() {
  return {davis346(DistortionModel::kNone, {}),
          davis346(DistortionModel::kRadtan, {-0.1386, 0.0934, -0.00034, 0.00017}),
          davis346(DistortionModel::kRadtan, {-0.1386, 0.0934, -0.00034, 0.00017, 0.002}),
          davis346(DistortionModel::kEquidistant, {-0.0480, 0.0113, -0.0554, 0.0215})};
}

TEST(Undistortion, EveryRayProjectsBackToItsPixel) {
  for (const CameraModel& model : realLenses()) {
    const UndistortionTable table(model);
    double largest_px = 0;
    for (int y = 0; y < model.height; ++y) {
      for (int x = 0; x < model.width; ++x) {
        const Eigen::Vector2d pixel = model.project(table.ray(x, y).homogeneous());
        largest_px = std::max(largest_px, (pixel - Eigen::Vector2d(x, y)).norm());
      }
    }
    // The iteration stops at 1e-9 px or better. What is left is the rounding to floats: 2^-25 of
    // offsets of up to 200 px from the principal point, a thousandth of a packet's error.
    EXPECT_LT(largest_px, 2e-5) << nameOf(model.distortion);
  }
}

TEST(Undistortion, ThePrincipalPointLooksStraightAhead) {
  CameraModel model = davis346(DistortionModel::kRadtan, {-0.1386, 0.0934, -0.00034, 0.00017});
  model.cx = 100;
  model.cy = 50;
  EXPECT_LT(UndistortionTable(model).ray(100, 50).norm(), 1e-12);
}

TEST(Camera, AWrongCountOfCoefficientsSaysWhatIsExpected) {
  const auto validate = [](DistortionModel distortion, std::vector<double> coefficients) {
    return [=] { davis346(distortion, coefficients).validate(); };
  };
  EXPECT_THAT(validate(DistortionModel::kRadtan, {0.1, 0.2, 0.3}),
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("coefficients = 3"), HasSubstr("4 or 5"))));
  EXPECT_THAT(validate(DistortionModel::kEquidistant, {0.1, 0.2, 0.3, 0.4, 0.5}),
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("coefficients = 5"), HasSubstr("4 (k1 k2 k3 k4)"))));
  EXPECT_THAT(validate(DistortionModel::kNone, {0.1}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("coefficients = 1")));
}

TEST(Camera, EveryFieldOutOfRangeIsNamed) {
  const auto with = [](auto change) {
    return [change] {
      CameraModel model = davis346(DistortionModel::kNone, {});
      change(model);
      model.validate();
    };
  };
  EXPECT_THAT(with([](CameraModel& m) { m.width = 0; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("width = 0")));
  EXPECT_THAT(with([](CameraModel& m) { m.height = 70000; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("height = 70000")));
  EXPECT_THAT(with([](CameraModel& m) { m.fx = -1; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("fx = -1")));
  EXPECT_THAT(with([](CameraModel& m) { m.cy = 0.0 / 0.0; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("cy = ")));
}

}  // namespace
}  // namespace efm::camera_test
