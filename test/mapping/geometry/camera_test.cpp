// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "mapping/geometry/lens.h"
#include "mapping/geometry/timestamp.h"
#include "test/mapping/base/refused_option.h"

namespace efm::camera_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// The principal point is a pixel.
CameraModel davis346(DistortionModel distortion, std::vector<double> coefficients) {
  return {346, 260, 226.38, 226.15, 174, 133, distortion, std::move(coefficients)};
}

TEST(Undistortion, EveryRayProjectsBackToItsPixel) {
  // Real lenses: a DAVIS240C's, once without k3, and a DAVIS346's fisheye.
  for (const CameraModel& model :
       {davis346(DistortionModel::kNone, {}),
        davis346(DistortionModel::kRadtan, {-0.1386, 0.0934, -0.00034, 0.00017}),
        davis346(DistortionModel::kRadtan, {-0.1386, 0.0934, -0.00034, 0.00017, 0.002}),
        davis346(DistortionModel::kEquidistant, {-0.0480, 0.0113, -0.0554, 0.0215})}) {
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
    EXPECT_TRUE(table.outsideLens().empty());
    EXPECT_EQ(table.ray(174, 133), Eigen::Vector2d(0, 0));
  }
}

TEST(Undistortion, APixelOutsideTheLensStandsForTheNextInsideTowardsTheAxis) {
  // The image folds over 118 px from the principal point, which may be beside the sensor.
  for (const double cx : {174.0, -30.0}) {
    CameraModel model = davis346(DistortionModel::kRadtan, {-0.55, 0, 0, 0});
    model.cx = cx;
    const UndistortionTable table(model);
    const Eigen::Vector2d axis(std::max(cx, 0.0), model.cy);
    for (int y = 0; y < model.height; y += 7) {
      for (int x = 0; x < model.width; x += 7) {
        const Eigen::Vector2d ray = table.rayNear(x, y);
        if (table.hasRay(x, y)) {
          ASSERT_EQ(ray, table.ray(x, y));
          continue;
        }
        const Eigen::Vector2d at = model.project(ray.homogeneous());
        const Eigen::Vector2d to_axis = axis - Eigen::Vector2d(x, y);
        const double left = to_axis.normalized().dot(axis - at);
        // Its column and row are rounded, and the next one outwards has no ray.
        ASSERT_LT((axis - at - left * to_axis.normalized()).norm(), 1.5) << x << ", " << y;
        ASSERT_GT(left, 0);
        const Eigen::Vector2d before = at - 2.5 * to_axis.normalized();
        ASSERT_FALSE(table.hasRay(static_cast<int>(std::lround(before.x())),
                                  static_cast<int>(std::lround(before.y()))));
      }
    }
  }
}

TEST(Camera, EveryFieldHasItsLimits) {
  using M = CameraModel;
  const std::vector<double> not_above_0 = {0, -1, NAN, INFINITY};
  const std::vector<double> not_finite = {NAN, INFINITY, -INFINITY};
  const auto last = [](M& model, double value) { model.coefficients[3] = value; };
  test::expectLimits<M>({{"width", &M::width, {1, 65'535}, {0, 65'536}},
                         {"height", &M::height, {1, 65'535}, {0, 65'536}},
                         {"fx", &M::fx, {1e-9}, not_above_0},
                         {"fy", &M::fy, {1e-9}, not_above_0},
                         {"cx", &M::cx, {-5, 0}, not_finite},
                         {"cy", &M::cy, {-5, 0}, not_finite},
                         {"distortion coefficient", last, {-5}, not_finite}},
                        davis346(DistortionModel::kRadtan, {0, 0, 0, 0}));
}

TEST(Camera, AWrongCountOfCoefficientsSaysWhatIsExpected) {
  const struct {
    DistortionModel model;
    std::vector<std::size_t> allowed;
    const char* expected;
  } cases[] = {{DistortionModel::kNone, {0}, "must be 0 for"},
               {DistortionModel::kRadtan, {4, 5}, "must be 4 or 5 (k1 k2 p1 p2 [k3])"},
               {DistortionModel::kEquidistant, {4}, "must be 4 (k1 k2 k3 k4)"}};
  for (const auto& c : cases) {
    for (std::size_t count = 0; count < 7; ++count) {
      const CameraModel model = davis346(c.model, std::vector<double>(count, 0.1));
      if (std::count(c.allowed.begin(), c.allowed.end(), count) > 0) {
        EXPECT_NO_THROW(model.validate()) << nameOf(c.model) << ", " << count;
        continue;
      }
      EXPECT_THAT([&] { model.validate(); },
                  ThrowsMessage<std::invalid_argument>(
                      HasSubstr("coefficients = " + std::to_string(count) + ": " + c.expected)));
    }
  }
}

using Change = std::function<void(RigCamera&)>;

TEST(RigCamera, ACalibrationThatIsNoneIsRefusedWithItsValue) {
  const std::vector<std::pair<const char*, Change>> cases = {
      {"fx = 0: must be", [](auto& c) { c.model.fx = 0; }},
      {"T_rig_cam: x = nan: must be", [](auto& c) { c.T_rig_cam.translation.x() = NAN; }},
      {"T_rig_cam: y = nan: must be", [](auto& c) { c.T_rig_cam.translation.y() = NAN; }},
      {"T_rig_cam: z = inf: must be", [](auto& c) { c.T_rig_cam.translation.z() = INFINITY; }},
      {"quaternion = nan: must be 1", [](auto& c) { c.T_rig_cam.rotation.w() = NAN; }},
      {"quaternion = 1.000002: must be 1", [](auto& c) { c.T_rig_cam.rotation.w() = 1.000002; }},
      {"quaternion = 0.999998: must be 1", [](auto& c) { c.T_rig_cam.rotation.w() = 0.999998; }},
      {"time offset = 4611686018.427387904: must be within 4611686018.427387903 s",
       [](auto& c) { c.time_offset_ns = kEndOfTimeNs + 1; }},
      {"time offset = -4611686018.427387904: must be within",
       [](auto& c) { c.time_offset_ns = -kEndOfTimeNs - 1; }},
  };
  RigCamera camera{davis346(DistortionModel::kNone, {}), {}, kEndOfTimeNs};
  camera.T_rig_cam.rotation.w() = 1 + 0.9e-6;
  EXPECT_NO_THROW(camera.validate());
  camera.time_offset_ns *= -1;
  EXPECT_NO_THROW(camera.validate());
  for (const auto& [message, change] : cases) {
    RigCamera wrong{davis346(DistortionModel::kNone, {}), {}, 0};
    change(wrong);
    EXPECT_THAT([&] { wrong.validate(); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(message)));
  }
}

TEST(RigCamera, IsTheSameUnlessAnyOfItsNumbersDiffers) {
  const RigCamera camera{davis346(DistortionModel::kRadtan, {0, 0, 0, 0}), {}, 5};
  EXPECT_TRUE(isSame(camera, camera));
  EXPECT_FALSE(camera.model != camera.model);
  const std::vector<Change> changes = {
      [](auto& c) { ++c.model.width; },
      [](auto& c) { ++c.model.height; },
      [](auto& c) { ++c.model.fx; },
      [](auto& c) { ++c.model.fy; },
      [](auto& c) { ++c.model.cx; },
      [](auto& c) { ++c.model.cy; },
      [](auto& c) { ++c.model.coefficients[3]; },
      [](auto& c) { c.model.distortion = DistortionModel::kEquidistant; },
      [](auto& c) { ++c.time_offset_ns; },
      [](auto& c) { ++c.T_rig_cam.translation.z(); },
      [](auto& c) { ++c.T_rig_cam.rotation.x(); }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    RigCamera other = camera;
    changes[i](other);
    EXPECT_FALSE(isSame(camera, other)) << i;
    EXPECT_EQ(camera.model != other.model, i < 8) << i;
  }
}

TEST(Rig, WithoutASelectionAllCamerasAreSelected) {
  EXPECT_TRUE(isSelected(2, {}));
  EXPECT_TRUE(isSelected(2, {0, 2}));
  EXPECT_FALSE(isSelected(1, {0, 2}));
  const Rig rig{std::vector<RigCamera>(3)};
  EXPECT_EQ(selectedCameras(rig, {}), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(selectedCameras(rig, {2, 0}), (std::vector<int>{2, 0}));
}

}  // namespace
}  // namespace efm::camera_test
