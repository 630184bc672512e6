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
  DepthFollower(const AutomaticOptions& automatic, const DepthPlanesOptions& planes)
      : automatic_(automatic), planes_(planes) {}

  /// @param depth of a keyframe that was mapped with `planes`: metres, 0 where there is none.
  /// @return whether the planes of the next keyframe differ.
  bool follow(const cv::Mat1f& depth);
  const DepthPlanesOptions& planes() const { return planes_; }

 private:
  AutomaticOptions automatic_;
  DepthPlanesOptions planes_;
};

}  // namespace efm
