// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numeric>

namespace efm {

/// A count for each enumerator of `Kind`, 0 to N - 1.
template <typename Kind, std::size_t N>
struct CountsBy {
  std::array<std::uint64_t, N> counts{};

  std::uint64_t& operator[](Kind kind) { return counts[static_cast<std::size_t>(kind)]; }
  std::uint64_t operator[](Kind kind) const { return counts[static_cast<std::size_t>(kind)]; }
  std::uint64_t total() const {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  }
  CountsBy& operator+=(const CountsBy& other) {
    for (std::size_t i = 0; i < N; ++i) counts[i] += other.counts[i];
    return *this;
  }
  friend bool operator==(const CountsBy& a, const CountsBy& b) { return a.counts == b.counts; }
};

/// The row of a fate in the table of all fates of a kind, in the order of the enumerators.
template <typename Kind>
struct FateRow {
  Kind fate;
  const char* key;      ///< Key in report.json.
  const char* text;     ///< Text after "5.1 %" in a summary.
  bool is_loss = true;  ///< True if lost in live operation; false if the options ask for it.
};

/// Number of events with each fate of a table.
template <const auto& kRows>
struct FateCounts : CountsBy<decltype(kRows[0].fate), std::size(kRows)> {
  /// Returns the number of events that are lost in live operation.
  std::uint64_t losses() const {
    std::uint64_t sum = 0;
    for (const auto& row : kRows) sum += row.is_loss ? (*this)[row.fate] : 0;
    return sum;
  }
};

/// The fate of an event in the mapping. Each event has one, at the latest when the mapping ends.
enum class EventFate {
  kUsed,           ///< The event voted in at least one keyframe.
  kWithoutPose,    ///< The trajectory has no pose at its time.
  kOutsideWindow,  ///< The event is in no window that was mapped.
  kLate,           ///< The event came after its windows were mapped.
  kDropped,        ///< In dropped windows, or late and before the end of a dropped window.
  kUnselected,     ///< From a camera that is not selected.
  kFiltered,       ///< Removed as noise, with or without a pose.
  kOutsideLens,    ///< The lens model has no viewing ray for its pixel (`LensInverse`).
  kOverBudget,     ///< In a mapped window, but not among the events chosen for it.
};

inline constexpr FateRow<EventFate> kEventFates[] = {
    {EventFate::kUsed, "used", "used", false},
    {EventFate::kWithoutPose, "without_pose", "without a pose"},
    {EventFate::kOutsideWindow, "outside_window", "outside the keyframes' windows", false},
    {EventFate::kLate, "late", "too late"},
    {EventFate::kDropped, "dropped", "in dropped windows"},
    {EventFate::kUnselected, "unselected", "of cameras that are not selected", false},
    {EventFate::kFiltered, "filtered", "filtered as noise", false},
    {EventFate::kOutsideLens, "outside_lens", "outside the lens model", false},
    {EventFate::kOverBudget, "over_budget", "over max_events_per_camera", false},
};
using EventFates = FateCounts<kEventFates>;
constexpr const FateRow<EventFate>& rowOf(EventFate fate) {
  return kEventFates[static_cast<std::size_t>(fate)];
}

/// Counts of one camera's events in the mapping. `read` is the sum of the fates of the mapping.
struct EventCounts {
  std::uint64_t read = 0;
  EventFates fates;

  std::uint64_t& operator[](EventFate fate) { return fates[fate]; }
  std::uint64_t operator[](EventFate fate) const { return fates[fate]; }
  EventCounts& operator+=(const EventCounts& other) {
    read += other.read;
    fates += other.fates;
    return *this;
  }
  friend bool operator==(const EventCounts& a, const EventCounts& b) {
    return a.read == b.read && a.fates == b.fates;
  }
};

/// Counts of votes. One vote is one used event on one plane:
/// cast + interpolated + outside_view + behind_camera = events x planes.
struct VoteCounts {
  std::uint64_t cast = 0;
  /// Votes that tiles did not cast, because they interpolate the plane (`coarseStep`). An estimate:
  /// a plane has as many as a coarse plane of its tile. `outside_view` is then the rest.
  std::uint64_t interpolated = 0;
  std::uint64_t outside_view = 0;   ///< Votes that have a neighbouring pixel outside the view.
  std::uint64_t behind_camera = 0;  ///< Votes whose point is behind the camera that saw the event.

  std::uint64_t total() const { return cast + interpolated + outside_view + behind_camera; }
  VoteCounts& operator+=(const VoteCounts& other) {
    cast += other.cast;
    interpolated += other.interpolated;
    outside_view += other.outside_view;
    behind_camera += other.behind_camera;
    return *this;
  }
};

}  // namespace efm
