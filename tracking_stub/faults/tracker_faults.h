// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "tracking_stub/faults/perturbed_poses.h"
#include "tracking_stub/faults/pose_dropouts.h"
#include "tracking_stub/faults/pose_source.h"

namespace efm {

/// All faults of a tracker. The default is none.
struct TrackerFaults {
  PosePerturbationOptions perturbation;
  PoseDropoutOptions dropouts;
  std::int64_t latency_ns = 0;  ///< 0 to 1e10, see PoseLatency.

  bool any() const;  ///< Whether any fault is enabled.
  void validate() const;
};

/// A source with faults. Poses are lost first, so the poses at a jump are never lost; then they are
/// perturbed, then delayed.
std::unique_ptr<PoseSource> withFaults(std::unique_ptr<PoseSource> source,
                                       const TrackerFaults& faults);

}  // namespace efm
