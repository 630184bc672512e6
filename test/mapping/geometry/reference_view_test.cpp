// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/reference_view.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "mapping/geometry/rigid3.h"
#include "test/mapping/base/refused_option.h"

namespace efm::reference_view_test {
namespace {

/// Pixels that are not squares, a principal point that is not in the middle.
const CameraModel kModel{120, 80, 95.0, 90.0, 62.3, 37.1, DistortionModel::kNone, {}};

Eigen::Vector3d rayOf(const ReferenceView& view, double x, double y) {
  return view.pointAt(x, y, 1.0);
}

ReferenceViewOptions sized(std::optional<int> width, std::optional<int> height) {
  ReferenceViewOptions options;
  options.width = width;
  options.height = height;
  return options;
}

void expectTheSameImageCorners(const ReferenceView& view) {
  const ReferenceView own = ReferenceView::of(kModel);
  for (const double across : {0.0, 0.3, 1.0}) {
    for (const double down : {0.0, 0.7, 1.0}) {
      // Pixels are squares around their centres: the image begins at -0.5.
      const Eigen::Vector3d expected =
          rayOf(own, across * own.width - 0.5, down * own.height - 0.5);
      const Eigen::Vector3d ray = rayOf(view, across * view.width - 0.5, down * view.height - 0.5);
      EXPECT_LT((ray - expected).norm(), 1e-12) << view.width << "x" << view.height;
    }
  }
}

TEST(ReferenceView, ASizeAloneKeepsTheFieldOfView) {
  for (const auto& options :
       {sized(240, std::nullopt), sized(std::nullopt, 40), sized(240, 160), sized(60, 80),
        sized(120, 80), sized(77, 13), sized(1, 1), sized({}, {})}) {
    expectTheSameImageCorners(makeReferenceView(kModel, options));
  }
}

TEST(ReferenceView, OneSideAloneKeepsTheShape) {
  EXPECT_EQ(makeReferenceView(kModel, sized(240, std::nullopt)).height, 160);
  EXPECT_EQ(makeReferenceView(kModel, sized(std::nullopt, 20)).width, 30);
  EXPECT_EQ(makeReferenceView(kModel, sized(100, std::nullopt)).height, 67) << "66.7 rounded";
  EXPECT_EQ(makeReferenceView(kModel, sized(1, std::nullopt)).height, 1) << "never none";
  CameraModel high = kModel;
  high.width = 1;
  EXPECT_EQ(makeReferenceView(high, sized(820, std::nullopt)).height, 65'535) << "never more";
}

TEST(ReferenceView, TheFieldOfViewIsTheAngleBetweenTheRaysOfLeftAndRightEdge) {
  for (const double fov_deg : {1.0, 60.0, 90.0, 170.0}) {
    for (ReferenceViewOptions options : {sized({}, {}), sized(300, {}), sized(200, 200)}) {
      options.fov_deg = fov_deg;
      const ReferenceView view = makeReferenceView(kModel, options);
      // In the row of the principal point, where rays lie in the plane of x and z.
      const Eigen::Vector3d left = rayOf(view, -0.5, view.cy);
      const Eigen::Vector3d right = rayOf(view, view.width - 0.5, view.cy);
      const double angle = std::atan2(left.cross(right).norm(), left.dot(right));
      EXPECT_NEAR(angle, fov_deg * kRadiansPerDegree, 1e-12);
      EXPECT_NEAR(left.x(), -right.x(), 1e-9 * right.x()) << "the principal point in the middle";
      EXPECT_DOUBLE_EQ(view.cy, 0.5 * (view.height - 1));
      EXPECT_NEAR(view.fy / view.fx, 90.0 / 95.0, 1e-12) << "pixels as they were";
    }
  }
}

TEST(ReferenceView, OptionsHaveTheirLimits) {
  using O = ReferenceViewOptions;
  const auto offset = [](int axis) {
    return [axis](O& options, double value) { options.offset_m[axis] = value; };
  };
  test::expectLimits<O>({{"fov_deg", &O::fov_deg, {1e-6, 179.9}, {0, -1, 180, NAN}},
                         {"width", &O::width, {1, 65'535}, {0, 65'536}},
                         {"height", &O::height, {1, 65'535}, {0, 65'536}},
                         {"rv_offset_m", offset(0), {-1}, {NAN, INFINITY}},
                         {"rv_offset_m", offset(1), {-1}, {NAN, INFINITY}},
                         {"rv_offset_m", offset(2), {-1}, {NAN, INFINITY}}});
  // At most 2^26 pixels, also where one side follows from the other.
  test::expectLimits<O>({{"width", &O::width, {8192}, {8193}}}, sized(1, 8192));
  EXPECT_NO_THROW(makeReferenceView(kModel, sized(10'032, {})));
  EXPECT_THROW(makeReferenceView(kModel, sized(10'033, {})), std::invalid_argument);
}

}  // namespace
}  // namespace efm::reference_view_test
