// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/subintervals.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>

#include "mapping/base/named_choice.h"
#include "mapping/base/option_check.h"

namespace efm {
namespace {

constexpr int kMaxSubintervals = 1000;

constexpr NamedChoice<SubintervalSplit> kSplits[] = {
    {SubintervalSplit::kDuration, "duration"},
    {SubintervalSplit::kCount, "count"},
};
constexpr NamedChoice<SubintervalShuffle> kShuffles[] = {
    {SubintervalShuffle::kNone, "none"},
    {SubintervalShuffle::kShift, "shift"},
    {SubintervalShuffle::kRandom, "random"},
};

/// Fisher and Yates. std::shuffle may draw differently with another standard library.
void shuffleWith(std::mt19937& random, std::vector<int>& items) {
  for (std::size_t left = items.size(); left > 1; --left) {
    std::swap(items[left - 1], items[random() % left]);
  }
}

std::size_t firstAtOrAfter(EventSpan events, std::int64_t t_ns) {
  const Event* first =
      std::lower_bound(events.begin(), events.end(), t_ns,
                       [](const Event& event, std::int64_t time) { return event.t_ns < time; });
  return static_cast<std::size_t>(first - events.begin());
}

}  // namespace

std::string_view nameOf(SubintervalSplit split) { return nameIn(kSplits, split); }
std::string_view nameOf(SubintervalShuffle shuffle) { return nameIn(kShuffles, shuffle); }
SubintervalSplit subintervalSplitFromName(std::string_view name) { return valueIn(kSplits, name); }
SubintervalShuffle subintervalShuffleFromName(std::string_view name) {
  return valueIn(kShuffles, name);
}

void SubintervalOptions::validate() const {
  requireOption(count >= 1 && count <= kMaxSubintervals, "subintervals", count, "1 to 1000");
}

std::vector<EventSpan> splitIntoSubintervals(EventSpan events, std::int64_t t0_ns,
                                             std::int64_t t1_ns,
                                             const SubintervalOptions& options) {
  const auto count = static_cast<std::size_t>(options.count);
  // A whole quotient and a rest, so that no product overflows.
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
      end = firstAtOrAfter(events, t0_ns + quotient_ns * steps + rest_ns * steps / options.count);
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

}  // namespace efm
