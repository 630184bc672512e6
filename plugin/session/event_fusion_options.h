// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/keyframes/fusion_mapper.h"
#include "maps/cloud/global_cloud.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/rig_setup.h"

namespace efm {

/// All options of an option file.
struct EventFusionOptions {
  FusionMapperOptions mapper;
  /// The cloud of a keyframe is the clouds of its single cameras, concatenated: the naive baseline
  /// (Ghosh and Gallego 2022, Sec. 3.3.1). Depth maps stay fused.
  bool late_fusion = false;
  GlobalCloudOptions cloud;
  MapRefinementOptions refinement;
  RigOptions rig;
};

}  // namespace efm
