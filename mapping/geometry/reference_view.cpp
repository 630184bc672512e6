// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/reference_view.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"

namespace efm {
namespace {

/// Converts depth to the quantity that is uniform over the planes. The same function converts back.
double uniformOf(PlaneSpacing spacing, double depth_m) {
  return spacing == PlaneSpacing::kInverse ? 1.0 / depth_m : depth_m;
}

}  // namespace

void DepthPlanesOptions::validate() const {
  // No camera sees larger depths, and planes and votes would lose digits.
  constexpr double kMaxDepthM = 1e6;
  requireFields(*this);
  requireOption(max_depth_m > min_depth_m, "max_depth_m", max_depth_m,
                "finite and above min_depth_m", {"min_depth_m"});
  requireOption(min_depth_m >= kMinDepthM, "min_depth_m", min_depth_m, "at least 0.001");
  requireOption(max_depth_m <= kMaxDepthM, "max_depth_m", max_depth_m, "at most 1000000");
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

namespace {

constexpr int kMaxSide = 65535;

/// Rejects sizes that are a mistake and would exhaust the memory.
void requirePixels(std::int64_t width, std::int64_t height) {
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;
  requireOption(width * height <= kMaxPixels, "width", width,
                "at most 67108864 pixels together with the height of " + std::to_string(height),
                {"height"});
}

/// Returns one side of the image from the other side and the camera's aspect ratio.
int sideInProportion(int other, int own_of_camera, int other_of_camera) {
  const double side = static_cast<double>(other) * own_of_camera / other_of_camera;
  return std::clamp(static_cast<int>(std::lround(side)), 1, kMaxSide);
}

}  // namespace

void ReferenceViewOptions::validate() const {
  requireFields(*this);
  if (width && height) requirePixels(*width, *height);
  for (int axis = 0; axis < 3; ++axis) {
    requireOption(std::isfinite(offset_m[axis]), "rv_offset_m", offset_m[axis], "finite");
  }
}

ReferenceView makeReferenceView(const CameraModel& model, const ReferenceViewOptions& options) {
  options.validate();
  ReferenceView view = ReferenceView::of(model);
  if (options.width) {
    view.width = *options.width;
    view.height = sideInProportion(*options.width, model.height, model.width);
  }
  if (options.height) {
    view.height = *options.height;
    if (!options.width) view.width = sideInProportion(*options.height, model.width, model.height);
  }
  requirePixels(view.width, view.height);
  if (options.fov_deg) {
    // Pixels are squares around their centres: the image extends from -0.5 to width - 0.5.
    view.fx = 0.5 * view.width / std::tan(0.5 * *options.fov_deg * kPi / 180.0);
    view.fy = view.fx * model.fy / model.fx;
    view.cx = 0.5 * (view.width - 1);
    view.cy = 0.5 * (view.height - 1);
  } else if (options.width || options.height) {
    const double scale_x = static_cast<double>(view.width) / model.width;
    const double scale_y = static_cast<double>(view.height) / model.height;
    view.fx = model.fx * scale_x;
    view.fy = model.fy * scale_y;
    view.cx = (model.cx + 0.5) * scale_x - 0.5;
    view.cy = (model.cy + 0.5) * scale_y - 0.5;
  }
  return view;
}

PlaneTransfer transferToPlane(const RayPacket& packet, const ReferenceView& view, double depth_m) {
  const Eigen::Vector3d& center_ref = packet.center_ref;
  const double nearer = center_ref.z() / depth_m;  // C_z / Z
  return {1.0 - nearer, (view.fx * center_ref.x() + view.cx * center_ref.z()) / depth_m,
          (view.fy * center_ref.y() + view.cy * center_ref.z()) / depth_m,
          packet.forward ? nearer < 1.0 : nearer > 1.0};
}

}  // namespace efm
