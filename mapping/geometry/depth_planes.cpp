// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/depth_planes.h"

#include <algorithm>
#include <cmath>

#include "mapping/base/named_choice.h"
#include "mapping/base/option_check.h"

namespace efm {
namespace {

constexpr NamedChoice<PlaneSpacing> kSpacings[] = {
    {PlaneSpacing::kInverse, "inverse"},
    {PlaneSpacing::kLinear, "linear"},
};

/// Depth to the quantity that is uniform over the planes, and back: the map is its own inverse.
double uniformOf(PlaneSpacing spacing, double depth_m) {
  return spacing == PlaneSpacing::kInverse ? 1.0 / depth_m : depth_m;
}

}  // namespace

std::string_view nameOf(PlaneSpacing spacing) { return nameIn(kSpacings, spacing); }
PlaneSpacing planeSpacingFromName(std::string_view name) { return valueIn(kSpacings, name); }

void DepthPlanesOptions::validate() const {
  constexpr int kMaxPlanes = 100'000;
  // No camera sees depths outside; beyond, planes and votes lose their digits.
  constexpr double kMaxDepthM = 1e6;
  requireOption(std::isfinite(min_depth_m) && min_depth_m > 0, "min_depth_m", min_depth_m,
                "finite and above 0");
  requireOption(std::isfinite(max_depth_m) && max_depth_m > kMinDepthM, "max_depth_m", max_depth_m,
                "finite and above 0.001");
  requireOption(max_depth_m > min_depth_m, "max_depth_m", max_depth_m,
                "finite and above min_depth_m");
  requireOption(min_depth_m >= kMinDepthM, "min_depth_m", min_depth_m, "at least 0.001");
  requireOption(max_depth_m <= kMaxDepthM, "max_depth_m", max_depth_m, "at most 1000000");
  requireOption(num_planes >= 1 && num_planes <= kMaxPlanes, "num_planes", num_planes,
                "1 to 100000");
}

DepthPlanes::DepthPlanes(const DepthPlanesOptions& options) : options_(options) {
  options_.validate();
  depths_.reserve(static_cast<std::size_t>(options_.num_planes));
  for (int i = 0; i < options_.num_planes; ++i) depths_.push_back(depthAt(i));
}

double DepthPlanes::depthAt(double position) const {
  const int last = options_.num_planes - 1;
  if (position == 0 || last == 0) return options_.min_depth_m;
  if (position == last) return options_.max_depth_m;
  const double first_u = uniformOf(options_.spacing, options_.min_depth_m);
  const double last_u = uniformOf(options_.spacing, options_.max_depth_m);
  return uniformOf(options_.spacing, first_u + (last_u - first_u) * (position / last));
}

double DepthPlanes::inverseDepthStepAt(double position) const {
  if (size() < 2) return 0.0;
  const double before = std::max(0.0, position - 0.5);
  const double after = std::min(size() - 1.0, position + 0.5);
  return (1.0 / depthAt(before) - 1.0 / depthAt(after)) / (after - before);
}

double DepthPlanes::inverseDepthStep() const {
  return size() < 2 ? 0.0 : 1.0 / depth(0) - 1.0 / depth(1);
}

}  // namespace efm
