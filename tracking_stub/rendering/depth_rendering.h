// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// The exact depth map of a scene: z-depth in metres on the ray through each pixel's centre. 0
/// where the ray hits nothing.
cv::Mat1f renderDepth(const Scene& scene, const Rigid3& T_world_cam, const ReferenceView& view);

}  // namespace efm
