// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_groups.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

#include "mapping/options/option_check.h"

namespace efm {
namespace {

constexpr int kMaxTimeSlices = 1000;

/// One camera's rays with the sub-intervals of each group in the order of their slots.
CameraRays inSlots(CameraRays rays, const std::vector<int>& slots) {
  CameraRays arranged;
  for (std::size_t group = 0; group < rays.size(); group += slots.size()) {
    for (const int part : slots) {
      arranged.push_back(std::move(rays[group + static_cast<std::size_t>(part)]));
    }
  }
  return arranged;
}

}  // namespace

void SplitFusionOptions::validate() const {
  requireOption(time_slices >= 1 && time_slices <= kMaxTimeSlices, "time_slices", time_slices,
                "1 to 1000");
}

std::vector<Event> eventsOfPolarity(EventSpan events, bool polarity) {
  std::vector<Event> chosen;
  chosen.reserve(events.size());
  std::copy_if(events.begin(), events.end(), std::back_inserter(chosen),
               [&](const Event& event) { return event.polarity == polarity; });
  return chosen;
}

SplitRays arrangeGroups(std::vector<CameraRays> cameras, int slices,
                        const std::vector<std::vector<int>>& slots) {
  assert(!cameras.empty() && slots.size() == cameras.size());
  SplitRays split;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    split.inputs.push_back(inSlots(std::move(cameras[c]), slots[c]));
  }
  const auto groups_of = [&](const CameraRays& rays) {
    return static_cast<int>(rays.size() / slots.front().size());
  };
  split.groups = groups_of(split.inputs.front());
  if (split.inputs.size() > 1 || slices == 1) return split;

  // A single camera: its slices stand for cameras.
  CameraRays rays = std::move(split.inputs.front());
  split.inputs.assign(static_cast<std::size_t>(slices), {});
  const std::size_t parts_of_slice = rays.size() / split.inputs.size();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    split.inputs[i / parts_of_slice].push_back(std::move(rays[i]));
  }
  split.groups = groups_of(split.inputs.front());
  return split;
}

}  // namespace efm
