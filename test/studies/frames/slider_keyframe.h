// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_mapper.h"

namespace efm::studies {

/// The events of `slider_depth` with a pose, and the true poses.
struct SliderRecording {
  Rig rig;
  std::vector<Event> events;
  Trajectory trajectory;
  /// 0.15 s from the first event with a pose, as in config/davis240c_slider.ini: 4.7 cm of travel.
  /// The reference view is in the middle.
  Window window;
};

/// @throws std::runtime_error naming the missing or invalid file.
SliderRecording readSlider(const std::filesystem::path& folder);

/// The depth map of the window.
/// @throws std::invalid_argument where the options are not valid.
KeyframeDepthMap sliderKeyframe(const SliderRecording& recording,
                                const KeyframeMapperOptions& options);

}  // namespace efm::studies
