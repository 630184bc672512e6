// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "mapping/keyframes/keyframe_policy.h"

namespace efm::test {

/// A recording of one camera that is known up to some time.
class KnownRecording : public RecordingProgress {
 public:
  std::int64_t start_ns = 0;
  std::int64_t complete_ns = kEndOfTimeNs;
  std::vector<std::int64_t> events_ns;  // in order
  std::function<std::optional<Rigid3>(std::int64_t)> T_world_ref_at;
  ReferenceView image{100, 80, 100, 100, 49.5, 39.5};

  std::int64_t startNs() const override { return start_ns; }
  std::int64_t reachedNs() const override { return complete_ns; }
  std::int64_t completeNs() const override { return complete_ns; }
  std::optional<std::int64_t> timeOfEvent(std::int64_t from_ns, std::int64_t count) const override {
    auto event = std::lower_bound(events_ns.begin(), events_ns.end(), from_ns);
    if (events_ns.end() - event < count) return std::nullopt;
    event += count - 1;
    return *event < complete_ns ? std::optional(*event) : std::nullopt;
  }
  std::int64_t eventsIn(std::int64_t t0_ns, std::int64_t t1_ns) const override {
    const auto first = std::lower_bound(events_ns.begin(), events_ns.end(), t0_ns);
    return std::lower_bound(first, events_ns.end(), t1_ns) - first;
  }
  std::optional<Rigid3> viewPoseAt(std::int64_t t_ns) const override {
    return T_world_ref_at(t_ns);
  }
  const ReferenceView& view() const override { return image; }
};

}  // namespace efm::test
