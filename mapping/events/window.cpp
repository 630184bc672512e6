// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/window.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

void TimeLimits::validate() const {
  if (!t0_ns || !t1_ns || *t0_ns < *t1_ns) return;
  throw std::invalid_argument("t1 = " + formatSeconds(*t1_ns) +
                              " s: must be after t0 = " + formatSeconds(*t0_ns) + " s");
}

namespace {

/// Shuffles as Fisher and Yates. std::shuffle may draw differently with another standard library.
void shuffleWith(std::mt19937& random, std::vector<int>& items) {
  for (std::size_t left = items.size(); left > 1; --left) {
    std::swap(items[left - 1], items[random() % left]);
  }
}

}  // namespace

std::vector<EventSpan> splitIntoSubintervals(EventSpan events, std::int64_t t0_ns,
                                             std::int64_t t1_ns,
                                             const SubintervalOptions& options) {
  const auto count = static_cast<std::size_t>(options.count);
  // An integer quotient and a remainder, so that no product overflows.
  const std::int64_t quotient_ns = (t1_ns - t0_ns) / options.count;
  const std::int64_t rest_ns = (t1_ns - t0_ns) % options.count;
  std::vector<EventSpan> parts;
  std::size_t begin = 0;
  for (std::size_t s = 1; s <= count; ++s) {
    std::size_t end = events.size();
    if (s < count && options.split == SubintervalSplit::kCount) {
      end = events.size() / count * s + events.size() % count * s / count;
    } else if (s < count) {
      const auto steps = static_cast<std::int64_t>(s);
      end = events.indexOf(t0_ns + quotient_ns * steps + rest_ns * steps / options.count);
    }
    parts.push_back(events.part(begin, end));
    begin = end;
  }
  return parts;
}

std::vector<std::vector<int>> assignSubintervals(int cameras, const SubintervalOptions& options) {
  const int count = options.count;
  std::mt19937 random(options.shuffle_seed);
  std::vector<std::vector<int>> assignment;
  for (int camera = 0; camera < cameras; ++camera) {
    std::vector<int>& slots = assignment.emplace_back(static_cast<std::size_t>(count));
    std::iota(slots.begin(), slots.end(), 0);
    if (options.shuffle == SubintervalShuffle::kShift) {
      const int shift = camera * std::max(1, count / cameras) % count;
      std::rotate(slots.begin(), slots.begin() + shift, slots.end());
    } else if (options.shuffle == SubintervalShuffle::kRandom) {
      shuffleWith(random, slots);
    }
  }
  return assignment;
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
    // This loop has no branch, because random polarities make a branch unpredictable.
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
  const int groups = split_.time_slices * split_.polarities();  // groups of one camera
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
