// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <stdexcept>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "test/plugin/temporary_folder.h"

namespace efm::reference_view_test {
namespace {

TEST(DepthPlanes, AreUniformBetweenExactLimits) {
  for (const PlaneSpacing spacing : {PlaneSpacing::kInverse, PlaneSpacing::kLinear}) {
    const bool inverse = spacing == PlaneSpacing::kInverse;
    for (const int count : {1, 2, 3, 100, 500}) {
      const DepthPlanes planes({0.47, 2.4, count, spacing});
      ASSERT_EQ(planes.size(), count);
      EXPECT_EQ(planes.depth(0), 0.47);
      EXPECT_EQ(planes.depth(count - 1), count == 1 ? 0.47 : 2.4);
      const int last = std::max(1, count - 1);
      for (double position = 0; position <= count - 1; position += 0.25) {
        const double way = position / last;
        const double expected =
            inverse ? 1 / (1 / 0.47 + way * (1 / 2.4 - 1 / 0.47)) : 0.47 + way * (2.4 - 0.47);
        EXPECT_NEAR(planes.depthAt(position), expected, 1e-12) << position << " of " << count;
        if (position == std::floor(position)) {
          EXPECT_EQ(planes.depth(static_cast<int>(position)), planes.depthAt(position));
        }
      }
    }
  }
}

TEST(DepthPlanes, StepsAreDistancesOfPlanesInInverseDepth) {
  for (const int count : {2, 100}) {
    const DepthPlanes inverse({0.5, 5.0, count, PlaneSpacing::kInverse});
    const double step = (1 / 0.5 - 1 / 5.0) / (count - 1);
    EXPECT_NEAR(inverse.inverseDepthStep(), step, 1e-15);
    for (const double way : {0.0, 0.002, 0.005, 0.4, 0.999, 1.0}) {
      EXPECT_NEAR(inverse.inverseDepthStepAt(way * (count - 1)), step, 1e-12) << way;
    }
  }
  // 1, 1.5, 2, 2.5 and 3 m: a step spans +-0.5 planes around a position, within the limits.
  const DepthPlanes linear({1.0, 3.0, 5, PlaneSpacing::kLinear});
  EXPECT_NEAR(linear.inverseDepthStep(), 1 - 1 / 1.5, 1e-15);
  EXPECT_NEAR(linear.inverseDepthStepAt(0), (1 - 1 / 1.25) / 0.5, 1e-12);
  EXPECT_NEAR(linear.inverseDepthStepAt(2), 1 / 1.75 - 1 / 2.25, 1e-12);
  EXPECT_NEAR(linear.inverseDepthStepAt(3.8), (1 / 2.65 - 1.0 / 3) / 0.7, 1e-12);
  const DepthPlanes one({0.5, 5.0, 1, PlaneSpacing::kInverse});
  EXPECT_EQ(one.inverseDepthStep(), 0);
  EXPECT_EQ(one.inverseDepthStepAt(0), 0);
}

TEST(DepthPlanes, LimitsAreInTheirOrderAndInTheRangeOfCameras) {
  const auto error = [](double min_depth_m, double max_depth_m) {
    return messageOf([&] { DepthPlanes({min_depth_m, max_depth_m, 10, PlaneSpacing::kInverse}); });
  };
  EXPECT_EQ(error(0.001, 1e6), "no error");
  EXPECT_EQ(error(0.5, 0.5), "max_depth_m = 0.5: must be finite and above min_depth_m");
  EXPECT_EQ(error(0.000999, 5), "min_depth_m = 0.000999: must be at least 0.001");
  EXPECT_EQ(error(0.5, 1'000'001), "max_depth_m = 1000001: must be at most 1000000");
}

/// A camera with non-square pixels and a principal point outside the middle.
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
      // Rays of the principal point's row lie in the plane of x and z.
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
  for (const int axis : {0, 1, 2}) {
    ReferenceViewOptions options;
    options.offset_m[axis] = NAN;
    EXPECT_EQ(messageOf([&] { options.validate(); }), "rv_offset_m = nan: must be finite");
  }
  // The limit is 2^26 pixels, also if one side is computed from the other side.
  EXPECT_NO_THROW(sized(8192, 8192).validate());
  EXPECT_THROW(sized(8193, 8192).validate(), OptionError);
  EXPECT_NO_THROW(makeReferenceView(kModel, sized(10'032, {})));
  EXPECT_THROW(makeReferenceView(kModel, sized(10'033, {})), OptionError);
}

TEST(Timestamp, DecimalTextIsReadToTheNanosecond) {
  const struct {
    const char* text;
    std::int64_t t_ns;
    int exponent = 0;  // of the unit
  } cases[] = {
      {"1700000000.123456789", 1'700'000'000'123'456'789},
      {"0.003811000", 3'811'000},
      {"12", 12'000'000'000},
      {"-0.5", -500'000'000},
      {"+.25", 250'000'000},
      {"7.", 7'000'000'000},
      {"1.5e-3", 1'500'000},
      {"2E1", 20'000'000'000},
      {"1.470419093562843323e+09", 1'470'419'093'562'843'323},
      {"1e-1000", 0},
      {"0e1000", 0},
      {"0.0000000014", 1},
      {"0.0000000015", 2},
      {"-0.0000000015", -2},
      {"0.9999999999", 1'000'000'000},
      {"5e-10", 1},
      {"4e-10", 0},
      {"9e-11", 0},
      {"9223372036.854775807", kMaxTimeNs},
      {"-9223372036.854775807", -kMaxTimeNs},
      {"12.5", 12'500, -6},
      {"-12.5e3", -12'500'000, -6},
      {"7.5", 8, -9},
  };
  for (const auto& c : cases) EXPECT_EQ(parseTimeIn(c.text, c.exponent), c.t_ns) << c.text;
  EXPECT_EQ(parseSeconds("12.5"), 12'500'000'000);
}

TEST(Timestamp, TextThatIsNoNumberOrDoesNotFitIsRejected) {
  for (const char* text : {"",
                           "-",
                           "+",
                           ".",
                           "abc",
                           "1,5",
                           "0x10",
                           "1.5s",
                           "1 ",
                           " 1",
                           "1e",
                           "nan",
                           "inf",
                           "1.2.3",
                           "--1",
                           "1e99999",
                           "0e1001",
                           "1e-1001",
                           "1e+-5",
                           "1e-+5",
                           "1e-2147483648",
                           "1e18",
                           "9223372036.854775808",
                           "9223372036.8547758075"}) {
    EXPECT_EQ(parseSeconds(text), std::nullopt) << "'" << text << "'";
  }
}

TEST(Timestamp, FormattingHasNineDecimals) {
  EXPECT_EQ(formatSeconds(1'700'000'000'123'456'789), "1700000000.123456789");
  EXPECT_EQ(formatSeconds(-1), "-0.000000001");
  EXPECT_EQ(formatSeconds(0), "0.000000000");
  EXPECT_EQ(formatSeconds(kMinTimeNs), "-9223372036.854775808");
}

RC_GTEST_PROP(Timestamp, ParsingUndoesFormatting, (std::int64_t t_ns)) {
  RC_PRE(t_ns != kMinTimeNs);
  RC_ASSERT(parseSeconds(formatSeconds(t_ns)) == t_ns);
}

TEST(Timestamp, DurationsAreRoundedAndMustFit) {
  EXPECT_EQ(durationFromSeconds(0.1), 100'000'000);
  EXPECT_EQ(durationFromSeconds(-1.5), -1'500'000'000);
  EXPECT_EQ(durationFromSeconds(0.6e-9), 1);
  EXPECT_EQ(durationFromSeconds(9.1e9), 9'100'000'000'000'000'000);
  for (const double wrong_s : {9.2e9, -9.2e9, 1e30, std::nan("")}) {
    EXPECT_THROW(durationFromSeconds(wrong_s), std::invalid_argument) << wrong_s;
  }
  EXPECT_EQ(secondsBetween(1'000'000'000, 3'500'000'000), 2.5);
}

}  // namespace

}  // namespace efm::reference_view_test
