// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_mapper.h"

namespace efm::studies {

/// The events of `slider_depth` with a pose and the true poses.
struct SliderRecording {
  Rig rig;
  std::vector<Event> events;
  Trajectory trajectory;
  /// 0.15 s from the first event with a pose, as config/davis240c_slider.ini has it: 4.7 cm of
  /// travel; the reference view in the middle.
  Window window;
};

/// @throws std::runtime_error naming the file that is missing or not understood.
SliderRecording readSlider(const std::filesystem::path& folder);

/// The depth map of the window. Planes and the like are the options'.
/// @throws std::invalid_argument where the options are not valid.
KeyframeDepthMap sliderKeyframe(const SliderRecording& recording,
                                const KeyframeMapperOptions& options);

}  // namespace efm::studies
