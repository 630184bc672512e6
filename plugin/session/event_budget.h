// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// Thins the events of one camera to a rate of sensor time: of each 10 ms of the camera's clock at
/// most a hundredth of the rate, spread evenly (`EvenChoice`). The choice depends on the events in
/// their order of arrival, not on the packets that they arrive in, nor on the machine.
///
/// The events of the current 10 ms are held until a later event, or a packet's cover, ends it. A
/// late event, of the second before, belongs to the current 10 ms. After a step of the clock
/// another interval is the current one.
class EventBudget {
 public:
  /// @param max_rate events per second; 0: all events pass at once.
  explicit EventBudget(double max_rate);

  /// @param covered_until_ns no event before this time is still to come; in: of the packet, out: of
  /// the events that passed.
  /// @return the events that pass, of this packet and of earlier ones.
  std::vector<Event> pass(std::vector<Event> events, std::optional<std::int64_t>& covered_until_ns);
  /// The rest, at the end.
  std::vector<Event> finish();

  std::uint64_t thinned() const { return thinned_; }
  /// Events that wait for the end of their 10 ms.
  std::size_t held() const { return held_.size(); }

 private:
  void endInterval(std::vector<Event>& passed);

  std::size_t max_per_interval_;
  std::int64_t interval_ = 0;  // number of the current 10 ms
  std::vector<Event> held_;    // its events
  std::uint64_t thinned_ = 0;
};

}  // namespace efm
