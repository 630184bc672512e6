// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/reference_view.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "mapping/base/option_check.h"
#include "mapping/geometry/angle.h"

namespace efm {
namespace {

constexpr int kMaxSide = 65535;
void requireSide(const std::optional<int>& side, const char* key) {
  requireOption(!side || (*side >= 1 && *side <= kMaxSide), key, side.value_or(0), "1 to 65535");
}

/// More pixels are a mistake that would exhaust the memory.
void requirePixels(std::int64_t width, std::int64_t height) {
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;
  requireOption(width * height <= kMaxPixels, "width", width,
                "at most 67108864 pixels together with the height of " + std::to_string(height));
}

/// One side of the image, given the other, with the camera's aspect ratio.
int sideInProportion(int other, int own_of_camera, int other_of_camera) {
  const double side = static_cast<double>(other) * own_of_camera / other_of_camera;
  return std::clamp(static_cast<int>(std::lround(side)), 1, kMaxSide);
}

}  // namespace

void ReferenceViewOptions::validate() const {
  requireOption(!fov_deg || (*fov_deg > 0 && *fov_deg < 180), "fov_deg", fov_deg.value_or(0),
                "above 0 and below 180");
  requireSide(width, "width");
  requireSide(height, "height");
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

}  // namespace efm
