// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// A limited number of consecutive events, evenly spread over them. The events are divided into
/// intervals of the same count, up to one event, and one event of each is chosen. Its position in
/// the interval is pseudo-random: a regular step could favour a sensor's rows or one polarity.
/// Depends on both numbers alone.
class EvenChoice {
 public:
  /// @param limit maximum number of chosen events; 0: all.
  EvenChoice(std::size_t events, std::size_t limit);

  /// Whether every event is chosen.
  bool all() const { return size_ == events_; }
  std::size_t size() const { return size_; }
  /// Index of the k-th chosen event, increasing with k.
  std::size_t operator[](std::size_t k) const;

 private:
  std::size_t events_;
  std::size_t size_;
};

/// The chosen events in their order: a view of `events` where all are chosen, otherwise of
/// `buffer`.
/// @param buffer receives the chosen events; the view is valid until it changes.
EventSpan chooseEvenly(EventSpan events, std::size_t limit, std::vector<Event>& buffer);
/// A copy of the chosen events.
std::vector<Event> chosenEvenly(EventSpan events, std::size_t limit);

}  // namespace efm
