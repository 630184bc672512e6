// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/tracker_faults.h"

#include <utility>

#include "mapping/base/named_choice.h"
#include "tracking_stub/faults/pose_latency.h"

namespace efm {

bool TrackerFaults::any() const { return perturbation.any() || dropouts.any() || latency_ns > 0; }

void TrackerFaults::validate() const {
  perturbation.validate();
  dropouts.validate();
  requireOption(latency_ns >= 0 && latency_ns <= PoseLatency::kMaxNs, "latency_ns", latency_ns,
                "0 to 1e10");
}

std::unique_ptr<PoseSource> withFaults(std::unique_ptr<PoseSource> source,
                                       const TrackerFaults& faults) {
  requireOption(source != nullptr, "source", "none", "given");
  faults.validate();
  if (faults.dropouts.any()) {
    source = std::make_unique<PoseDropouts>(std::move(source), faults.dropouts);
  }
  if (faults.perturbation.any()) {
    source = std::make_unique<PerturbedPoses>(std::move(source), faults.perturbation);
  }
  if (faults.latency_ns > 0) {
    source = std::make_unique<PoseLatency>(std::move(source), faults.latency_ns);
  }
  return source;
}

}  // namespace efm
