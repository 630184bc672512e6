// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_groups.h"

#include <algorithm>

#include "mapping/base/option_check.h"

namespace efm {
namespace {

constexpr int kMaxTimeSlices = 1000;

}  // namespace

void SplitFusionOptions::validate() const {
  requireOption(time_slices >= 1 && time_slices <= kMaxTimeSlices, "time_slices", time_slices,
                "1 to 1000");
}

EventSpan EventPart::select(PolaritySplit& split) const {
  if (!polarity) return all;
  if (split.all.begin() != all.begin() || split.all.end() != all.end()) {
    split.all = all;
    const auto on_events = static_cast<std::size_t>(
        std::count_if(all.begin(), all.end(), [](const Event& event) { return event.polarity; }));
    const std::size_t sizes[2] = {all.size() - on_events, on_events};
    for (const std::size_t on : {0, 1}) {
      if (split.of[on].size() < sizes[on]) split.of[on].resize(sizes[on]);
    }
    // Without a branch, which random polarities make unpredictable.
    Event* next[2] = {split.of[0].data(), split.of[1].data()};
    for (const Event& event : all) *next[event.polarity ? 1 : 0]++ = event;
    split.size[0] = sizes[0];
    split.size[1] = sizes[1];
  }
  const std::size_t on = *polarity ? 1 : 0;
  return EventSpan(split.of[on]).part(0, split.size[on]);
}

EventGroups::EventGroups(const SplitFusionOptions& split, const SubintervalOptions& subintervals)
    : split_(split), subintervals_(subintervals) {}

std::size_t EventGroups::subintervals() const {
  return static_cast<std::size_t>(split_.time_slices) *
         static_cast<std::size_t>(subintervals_.count);
}

std::vector<EventPart> EventGroups::partsOf(EventSpan events, const Window& window) const {
  SubintervalOptions all = subintervals_;
  all.count *= split_.time_slices;
  const std::vector<EventSpan> spans =
      splitIntoSubintervals(events, window.t0_ns, window.t1_ns, all);
  const auto count = static_cast<std::size_t>(subintervals_.count);
  std::vector<EventPart> parts;
  for (std::size_t first = 0; first < spans.size(); first += count) {
    for (int polarity = 0; polarity < split_.polarities(); ++polarity) {
      for (std::size_t s = first; s < first + count; ++s) {
        parts.push_back({spans[s], std::nullopt, s});
        if (split_.polarity) parts.back().polarity = polarity == 1;
      }
    }
  }
  return parts;
}

FusionLayout EventGroups::layoutOf(int cameras) const {
  const std::vector<std::vector<int>> slots = assignSubintervals(cameras, subintervals_);
  const int groups = split_.time_slices * split_.polarities();  // of a camera
  FusionLayout layout;
  layout.groups = cameras == 1 ? split_.polarities() : groups;
  for (std::size_t camera = 0; camera < slots.size(); ++camera) {
    for (int group = 0; group < groups; ++group) {
      if (group % layout.groups == 0) layout.inputs.emplace_back();
      for (const int subinterval : slots[camera]) {
        layout.inputs.back().push_back(
            {camera, static_cast<std::size_t>(group * subintervals_.count + subinterval)});
      }
    }
  }
  return layout;
}

}  // namespace efm
