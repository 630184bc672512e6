// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_groups.h"

#include <algorithm>

#include "mapping/options/option_check.h"

namespace efm {
namespace {

constexpr int kMaxTimeSlices = 1000;

}  // namespace

void SplitFusionOptions::validate() const {
  requireOption(time_slices >= 1 && time_slices <= kMaxTimeSlices, "time_slices", time_slices,
                "1 to 1000");
}

EventSpan EventPart::select(std::vector<Event>& buffer) const {
  if (!polarity) return all;
  const auto count = static_cast<std::size_t>(
      std::count_if(all.begin(), all.end(),
                    [this](const Event& event) { return event.polarity == *polarity; }));
  // Without a branch, which random polarities make unpredictable: an event of the other polarity is
  // overwritten by the next one.
  buffer.reserve(all.size() + 1);  // takes no memory before it is written
  if (buffer.size() < count + 1) buffer.resize(count + 1);
  std::size_t size = 0;
  for (const Event& event : all) {
    buffer[size] = event;
    size += event.polarity == *polarity ? 1 : 0;
  }
  return {buffer.data(), buffer.data() + count};
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
