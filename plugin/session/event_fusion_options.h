// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "maps/cloud/global_cloud.h"
#include "plugin/session/live_options.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/rig_setup.h"

namespace efm {

/// All options of an option file.
struct EventFusionOptions {
  FusionMapperOptions mapper;
  /// Options of the mapper whose values are chosen from the data.
  AutomaticOptions automatic;
  /// The cloud of a keyframe is the clouds of its single cameras, concatenated: the naive baseline
  /// (Ghosh and Gallego 2022, Sec. 3.3.1). Depth maps stay fused.
  bool late_fusion = false;
  GlobalCloudOptions cloud;
  MapRefinementOptions refinement;
  RigOptions rig;
  LiveOptions live;
  bool ply = false;  ///< `map` also writes map.ply, coloured by height.
};

/// The options of a program that was told nothing: what can be chosen from the data is.
inline EventFusionOptions defaultOptions() {
  EventFusionOptions options;
  options.automatic = {true, true, true, true, true};
  return options;
}

}  // namespace efm
