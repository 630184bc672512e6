// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "tracking_stub/faults/perturbed_poses.h"
#include "tracking_stub/faults/pose_dropouts.h"
#include "tracking_stub/poses/pose_source.h"

namespace efm {

/// All that may be wrong with a tracker. The default is nothing.
struct TrackerFaults {
  PosePerturbationOptions perturbation;
  PoseDropoutOptions dropouts;
  std::int64_t latency_ns = 0;  ///< 0 to 1e10, see PoseLatency.

  /// Whether anything would change.
  bool any() const;
  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A source's poses as a tracker with such faults would give them: what is lost is lost first, so
/// that a pose that marks a jump never is; then poses are perturbed, then they come late.
/// @throws std::invalid_argument where the faults are not valid or there is no source.
std::unique_ptr<PoseSource> withFaults(std::unique_ptr<PoseSource> source,
                                       const TrackerFaults& faults);

}  // namespace efm
