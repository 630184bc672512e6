// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/geometry/lens.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"
#include "test/plugin/temporary_folder.h"

namespace efm::lens_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Returns a camera whose principal point is the centre of a pixel.
CameraModel davis346(DistortionModel distortion, std::vector<double> coefficients) {
  return {346, 260, 226.38, 226.15, 174, 133, distortion, std::move(coefficients)};
}

TEST(Undistortion, ThePrincipalPointLooksAlongTheAxis) {
  for (const CameraModel& model :
       {davis346(DistortionModel::kNone, {}),
        davis346(DistortionModel::kRadtan, {-0.1386, 0.0934, -0.00034, 0.00017}),
        davis346(DistortionModel::kEquidistant, {-0.0480, 0.0113, -0.0554, 0.0215})}) {
    EXPECT_EQ(UndistortionTable(model).ray(174, 133), Eigen::Vector2d(0, 0));
  }
}

TEST(Undistortion, TablesOfOneLensShareTheirRays) {
  const CameraModel model = davis346(DistortionModel::kRadtan, {-0.1386, 0.0934, 0, 0});
  CameraModel other = model;
  other.coefficients[0] = -0.1387;
  const UndistortionTable table(model);
  EXPECT_EQ(UndistortionTable(model).rays(), table.rays());
  const UndistortionTable of_other(other);
  EXPECT_NE(of_other.rays(), table.rays());
  EXPECT_NE(of_other.ray(0, 0), table.ray(0, 0));
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
        // The column and row of that pixel are rounded, and the next pixel outwards has no ray.
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
  const struct {
    std::string key;
    std::function<void(M&, double)> set;
    std::vector<double> allowed;
    std::vector<double> rejected;
  } cases[] = {
      {"width", [](M& m, double v) { m.width = int(v); }, {1, 65'535}, {0, 65'536}},
      {"height", [](M& m, double v) { m.height = int(v); }, {1, 65'535}, {0, 65'536}},
      {"fx", [](M& m, double v) { m.fx = v; }, {1e-9}, not_above_0},
      {"fy", [](M& m, double v) { m.fy = v; }, {1e-9}, not_above_0},
      {"cx", [](M& m, double v) { m.cx = v; }, {-5, 0}, not_finite},
      {"cy", [](M& m, double v) { m.cy = v; }, {-5, 0}, not_finite},
      {"distortion coefficient", [](M& m, double v) { m.coefficients[3] = v; }, {-5}, not_finite}};
  for (const auto& c : cases) {
    M model = davis346(DistortionModel::kRadtan, {0, 0, 0, 0});
    for (const double value : c.allowed) {
      c.set(model, value);
      EXPECT_NO_THROW(model.validate()) << c.key << " = " << value;
    }
    for (const double value : c.rejected) {
      c.set(model, value);
      EXPECT_THAT(messageOf([&] { model.validate(); }), testing::StartsWith(c.key + " = "));
    }
  }
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

TEST(RigCamera, ACalibrationThatIsNoneIsRejectedWithItsValue) {
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

using Real = long double;

/// The distorted radius r of an undistorted radius rho, and dr/drho.
struct Radius {
  Real r, slope;
};

Radius radiusAt(const std::vector<double>& k, Real rho) {
  const Real s = rho * rho;
  Real power = 1;
  Radius result{1, 1};
  for (std::size_t i = 0; i < k.size(); ++i) {
    power *= s;
    result.r += static_cast<Real>(k[i]) * power;
    result.slope += static_cast<Real>(2 * i + 3) * static_cast<Real>(k[i]) * power;
  }
  result.r *= rho;
  return result;
}

template <typename Condition>
Real lastWhere(const Condition& holds, Real low, Real high) {
  for (int i = 0; i < 80; ++i) {
    const Real middle = (low + high) / 2;
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

/// Returns rho of the fold of the lens, found by steps outwards from the centre.
Real foldOf(const std::vector<double>& k, Real max_rho) {
  constexpr Real kStep = 1e-3L;
  const auto rises = [&](Real rho) { return radiusAt(k, rho).slope > 0; };
  Real rho = 0;
  while (rho < max_rho && rises(rho + kStep)) rho += kStep;
  return std::min(max_rho, lastWhere(rises, rho, rho + kStep));
}

/// Returns the exact inverse of a lens without tangential distortion; std::nullopt beyond the fold.
std::optional<Real> rhoOf(const std::vector<double>& k, Real r, Real fold) {
  if (radiusAt(k, fold).r < r) return std::nullopt;
  return lastWhere([&](Real rho) { return radiusAt(k, rho).r < r; }, 0, fold);
}

struct Lens {
  std::string name;
  double focal_px;
  DistortionModel distortion;
  std::vector<double> radial;  ///< k1, k2 ...
  bool covers;                 ///< True if every pixel has a ray.
};

constexpr auto kRadtan = DistortionModel::kRadtan;
constexpr auto kEquidistant = DistortionModel::kEquidistant;

/// Lenses with the centre between pixels, so that four pixels are equivalent.
const std::vector<Lens> kLenses = {
    {"no distortion", 226, DistortionModel::kNone, {0, 0, 0}, true},
    {"strong barrel, invertible everywhere", 180, kRadtan, {-0.45, 0.2, 0}, true},
    {"strong barrel with k3", 170, kRadtan, {-0.6, 0.5, -0.1}, true},
    {"folds over", 230, kRadtan, {-0.5, 0, 0}, false},
    {"folds over and rises again", 250, kRadtan, {-0.6, 0.15, 0}, false},
    {"pincushion", 250, kRadtan, {0.5, 0.3, 0.1}, true},
    {"fisheye", 120, kEquidistant, {-0.048, 0.0113, -0.0554, 0.0215}, false},
    {"fisheye beyond 90 degrees", 100, kEquidistant, {0.05, 0.01, 0, 0}, false},
    {"fisheye that folds over and rises again", 160, kEquidistant, {-0.5, 0.1, 0.02, 0}, false},
    {"fisheye that folds over twice", 440, kEquidistant, {-0.85, -0.15, 0.65, -0.2}, false},
};

CameraModel cameraOf(const Lens& lens) {
  const std::vector<double>& k = lens.radial;
  std::vector<double> coefficients = k;
  if (lens.distortion == kRadtan) coefficients = {k[0], k[1], 0, 0, k[2]};
  if (lens.distortion == DistortionModel::kNone) coefficients.clear();
  return {346, 260, lens.focal_px, lens.focal_px, 172.5, 129.5, lens.distortion, coefficients};
}

TEST(LensInverse, RaysAreExactUpToTheFoldAndNoPixelBeyondItHasOne) {
  for (const Lens& lens : kLenses) {
    const CameraModel model = cameraOf(lens);
    const LensInverse inverse(model);
    const UndistortionTable table(model);
    const bool fisheye = lens.distortion == kEquidistant;
    const Real fold = foldOf(lens.radial, fisheye ? std::atan(1e4L) : 10);
    int outside = 0;
    double largest_px = 0;
    for (int y = 0; y < model.height / 2; ++y) {
      for (int x = 0; x < model.width / 2; ++x) {
        const Eigen::Vector2d distorted((x - model.cx) / model.fx, (y - model.cy) / model.fy);
        const Real r =
            std::hypot(static_cast<Real>(distorted.x()), static_cast<Real>(distorted.y()));
        const std::optional<Real> rho = rhoOf(lens.radial, r, fold);
        ASSERT_EQ(table.hasRay(x, y), rho.has_value()) << lens.name << ": " << x << ", " << y;
        const Eigen::Vector2d ray = inverse.rayThrough(x, y);
        ASSERT_EQ(std::isnan(ray.x()), !rho) << lens.name << ": " << x << ", " << y;
        if (!rho) {
          outside += 4;
          continue;
        }
        const Real length = fisheye ? std::tan(*rho) : *rho;
        const Eigen::Vector2d exact = static_cast<double>(length / r) * distorted;
        EXPECT_LT((ray - exact).norm(), 1e-7 * (1 + exact.norm())) << lens.name;
        EXPECT_LT((table.ray(x, y) - exact).norm(), 1e-7 * (1 + exact.norm())) << lens.name;
        const Eigen::Vector2d pixel = model.project(ray.homogeneous());
        largest_px = std::max(largest_px, (pixel - Eigen::Vector2d(x, y)).norm());
      }
    }
    EXPECT_LT(largest_px, 1e-6) << lens.name;
    if (lens.covers) {
      EXPECT_EQ(outside, 0) << lens.name;
      EXPECT_TRUE(table.outsideLens().empty()) << lens.name;
    } else {
      EXPECT_GT(outside, 1000) << lens.name << ": the case is there";
      EXPECT_LT(outside, 346 * 260 / 2) << lens.name;
      const std::vector<bool> mask = table.outsideLens();
      EXPECT_EQ(std::count(mask.begin(), mask.end(), true), outside) << lens.name;
    }
  }
}

/// Returns the distorted ray of the model with tangential distortion.
Eigen::Vector2d distorted(const std::vector<double>& c, const Eigen::Vector2d& ray) {
  const double x = ray.x();
  const double y = ray.y();
  const double s = x * x + y * y;
  const double ratio = 1 + c[0] * s + c[1] * s * s + (c.size() > 4 ? c[4] * s * s * s : 0);
  return {x * ratio + 2 * c[2] * x * y + c[3] * (s + 2 * x * x),
          y * ratio + c[2] * (s + 2 * y * y) + 2 * c[3] * x * y};
}

bool isOnBranch(const std::vector<double>& c, const Eigen::Vector2d& ray) {
  constexpr double kStep = 1e-5;
  Eigen::Matrix2d by_ray;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
    by_ray.col(i) = (distorted(c, ray + step) - distorted(c, ray - step)) / (2 * kStep);
  }
  return by_ray.determinant() > 0 && by_ray.trace() > 0;
}

/// Steps outwards from the centre along many rays up to the fold.
/// @return per pixel, whether the lens projects a ray to it.
cv::Mat1b pixelsSeen(const CameraModel& model) {
  cv::Mat1b seen = cv::Mat1b::zeros(model.height, model.width);
  constexpr int kDirections = 5000;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * M_PI * i / kDirections;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    for (double length = 0; length < 4; length += 2e-3) {
      const Eigen::Vector2d ray = length * direction;
      if (!isOnBranch(model.coefficients, ray)) break;
      const Eigen::Vector2d at = distorted(model.coefficients, ray);
      const cv::Point pixel(cvRound(model.fx * at.x() + model.cx),
                            cvRound(model.fy * at.y() + model.cy));
      if (pixel.inside({0, 0, model.width, model.height})) seen(pixel) = 1;
    }
  }
  return seen;
}

TEST(LensInverse, TangentialDistortionIsInvertedOnTheBranchOfTheCentre) {
  const struct {
    double focal_px;
    std::vector<double> coefficients;
  } lenses[] = {{180, {-0.45, 0.2, 0.01, -0.02}},
                {180, {-0.5, 0, 0.02, 0.01}},
                {180, {-0.6, 0.15, -0.01, 0.005, 0}},
                {180, {0.2, 0.1, -0.02, 0.03, 0.05}},
                {90, {-0.05, 0, 0.02, 0.01}}};  // folds over far out: rays of 2.6
  for (const auto& [focal_px, coefficients] : lenses) {
    const CameraModel model{346, 260, focal_px, focal_px + 2, 160.25, 140.5, kRadtan, coefficients};
    const LensInverse inverse(model);
    const UndistortionTable table(model);
    const cv::Mat1b seen = pixelsSeen(model);
    double largest_px = 0;
    double largest_step = 0;
    int wrong = 0;
    int from_elsewhere = 0;
    for (int y = 1; y < model.height - 1; ++y) {
      for (int x = 1; x < model.width - 1; ++x) {
        const int around = cv::countNonZero(seen(cv::Rect(x - 1, y - 1, 3, 3)));
        const bool has_ray = table.hasRay(x, y);
        if ((around == 9 && !has_ray) || (around == 0 && has_ray)) ++wrong;
        if (!has_ray) continue;
        const Eigen::Vector2d ray = table.ray(x, y);
        const Eigen::Vector2d pixel = model.project(ray.homogeneous());
        largest_px = std::max(largest_px, (pixel - Eigen::Vector2d(x, y)).norm());
        // The result is the same if the search starts far away.
        from_elsewhere += (inverse.rayThrough(x, y, -3 * ray) - ray).norm() < 1e-3 ? 0 : 1;
        if (!table.hasRay(x - 1, y)) continue;
        largest_step = std::max(largest_step, (ray - table.ray(x - 1, y)).norm());
      }
    }
    EXPECT_EQ(wrong, 0) << coefficients[0];
    EXPECT_EQ(from_elsewhere, 0) << coefficients[0];
    EXPECT_LT(largest_px, 1e-4);
    EXPECT_LT(largest_step * focal_px, 36) << "adjacent rays are near each other, also at a fold";
  }
}

TEST(LensInverse, ALensThatProjectsNothingToTheSensorIsRejected) {
  CameraModel model = cameraOf(kLenses[3]);
  model.cx = 2000;
  EXPECT_THAT([&] { UndistortionTable{model}; },
              ThrowsMessage<std::invalid_argument>(HasSubstr("no pixel")));
}

}  // namespace

}  // namespace efm::lens_test
