// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "maps/refinement/keyframe_registration.h"
#include "maps/refinement/loop_closing.h"
#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/registration_cloud.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {

struct RefinementOptions {
  TrackerErrors tracker;      ///< The expected errors of the incoming poses.
  bool adapt_tracker = true;  ///< Learn these errors from the keyframes.
  RegistrationCloudOptions points;
  KeyframeRegistrationOptions registration;
  /// Number of last keyframes that are solved together. Earlier ones stay until a loop is closed.
  /// Range: 1 to 1000.
  int window = 10;
  /// Number of these keyframes that a new one is registered with: those with the largest overlap.
  /// Range: 1 to 100.
  int map_keyframes = 3;
  LoopOptions loop;
  PoseGraphOptions graph;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

}  // namespace efm
