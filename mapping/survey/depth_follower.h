// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/geometry/depth_planes.h"
#include "mapping/survey/option_choice.h"

namespace efm {

/// Lets automatic depth limits follow the scene from keyframe to keyframe, where nothing is known
/// of the recording ahead: live operation. Depends on the keyframes alone.
class DepthFollower {
 public:
  /// @param automatic the options that may change. @param planes of the first keyframe.
  /// @param parallax_px_m of the windows, for the number of planes: see `automaticPlanes`.
  DepthFollower(const AutomaticOptions& automatic, const DepthPlanesOptions& planes,
                double parallax_px_m)
      : automatic_(automatic), planes_(planes), parallax_px_m_(parallax_px_m) {}

  /// @param depth of a keyframe that was mapped with `planes`: metres, 0 where there is none.
  /// @return whether the planes of the next keyframe differ.
  bool follow(const cv::Mat1f& depth);
  const DepthPlanesOptions& planes() const { return planes_; }
  /// How many keyframes in a row had hardly any point, or many at an automatic limit: the limits
  /// may not fit the scene.
  int misfits() const { return misfits_; }

 private:
  AutomaticOptions automatic_;
  DepthPlanesOptions planes_;
  double parallax_px_m_;
  int misfits_ = 0;
};

}  // namespace efm
