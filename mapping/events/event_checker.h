// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

/// Finds the events of a camera whose times are wrong. They come in bursts: a damaged time word of
/// a sensor dates hundreds of events.
///
/// The rule: an event is late if it is over 10 ms older than the newest one. An event that is over
/// 10 ms newer begins a pause, and the events behind a pause wait until 20 ms of them follow in
/// order without another pause: longer than a burst lasts. If others come meanwhile that go back
/// into the pause, not all can be right: those stay that are in order with the confirmed ones, and
/// as many of them as possible; the rest is wrong. The first and the last events of a stream are
/// wrong if a pause of over 10 s divides them from the others, they last less than 20 ms, and no
/// pose is near. At most a million events wait (16 MB).
///
/// Poses have the same rule with other limits, see `PoseIntake`.
class EventChecker {
 public:
  struct Limits {
    std::int64_t pause_ns = kMaxEventDelayNs;  ///< A longer step ahead begins a pause.
    /// A stream must go on for this long behind a pause: longer than bursts of wrong times. A time
    /// word of a sensor (EVT 3) counts for 4.1 ms.
    std::int64_t confirming_ns = 20'000'000;
    std::size_t max_waiting = 1'000'000;
  };
  /// An event whose waiting has ended.
  struct Settled {
    Event event;
    bool wrong = false;
    std::uint64_t first = 0;     ///< Number of the first event since the last pause or step back.
    std::int64_t before_ns = 0;  ///< Newest time before that one; -kEndOfTimeNs at the beginning.
  };
  enum class Verdict { kBeginsRun, kWaits, kLate };

  EventChecker() = default;
  explicit EventChecker(const Limits& limits) : limits_(limits) {}

  /// Data of other sensors (poses, for events) from `first_ns` to `last_ns`, on this sensor's
  /// clock, confirm the first and the last events.
  void expectOthers(std::int64_t first_ns, std::int64_t last_ns) {
    others_ns_ = {first_ns, last_ns};
  }

  /// Adds an event if it follows the newest one at once, and nothing waits. @return whether it did.
  bool pass(const Event& event) {
    const bool near =
        event.t_ns >= newest_ns_ - limits_.pause_ns && event.t_ns <= newest_ns_ + limits_.pause_ns;
    if (!near || !waiting_.empty()) return false;
    newest_ns_ = std::max(newest_ns_, event.t_ns);
    return true;
  }
  /// Adds any other event. kBeginsRun: it waits, as the first one behind a pause or a step back.
  /// @param number of the event, for `Settled`.
  Verdict add(const Event& event, std::uint64_t number);
  /// Returns the events whose waiting ended in the last call, in the order of arrival.
  std::vector<Settled> takeSettled() { return std::exchange(settled_, {}); }
  /// Ends the waiting. @param at_end false if the stream is damaged: the last events are right
  /// then.
  void finish(bool at_end) { settle(at_end ? Settle::kAtEnd : Settle::kAtDamage); }
  /// Ends the waiting, because the last event is known to be right.
  void confirmLast() { settle(Settle::kToConfirmed); }
  /// Continues at this time: the clock may have gone back.
  void follow(std::int64_t t_ns) { newest_ns_ = t_ns; }

  /// Returns the newest time of the events that are known to be right.
  std::int64_t newestNs() const { return newest_ns_; }
  /// Returns the earliest time of the events that wait; kMaxTimeNs if there is none.
  std::int64_t waitsSinceNs() const;
  /// Returns the earliest time of the events that wait behind the last pause; kMaxTimeNs: none.
  std::int64_t lastRunSinceNs() const { return runs_.empty() ? kMaxTimeNs : runs_.back().min_ns; }
  /// Returns the newest time of the last events, also if they wait.
  std::int64_t lastNs() const { return runs_.empty() ? newest_ns_ : runs_.back().max_ns; }

 private:
  /// Successive waiting events without a pause.
  struct Run {
    std::size_t begin = 0, end = 0;  // in waiting_
    std::int64_t min_ns = 0, max_ns = 0;
    std::uint64_t first = 0;     // as in Settled
    std::int64_t before_ns = 0;  // as in Settled
    bool wrong = false;
  };
  enum class Settle { kToConfirmed, kToMiddle, kAtEnd, kAtDamage };

  bool areOthersNear(const Run& run) const;
  std::vector<std::size_t> longestChain(bool ends_with_last) const;
  bool rejectLoose(const std::vector<std::size_t>& chain, bool at_end);
  void settle(Settle how);

  Limits limits_;
  std::optional<std::pair<std::int64_t, std::int64_t>> others_ns_;
  std::int64_t newest_ns_ = -kEndOfTimeNs;
  std::vector<Event> waiting_;
  std::vector<Run> runs_;
  std::vector<Settled> settled_;
};

/// Checks the events that a program adds to a camera, in any portions.
class EventIntake {
 public:
  EventIntake(int camera, RigCamera calibration)
      : camera_(camera), calibration_(std::move(calibration)) {}

  /// @return the events that are right, of this call and of earlier ones. The others wait, or have
  /// a wrong time and are left out: see EventChecker.
  /// @throws std::invalid_argument if an event is not possible, or is late. Then nothing of this
  /// call is added.
  CheckedEvents add(std::vector<Event> events);
  /// Poses confirm the first and the last events.
  void expectPoses(std::int64_t first_ns, std::int64_t last_ns) {
    const std::int64_t offset_ns = calibration_.time_offset_ns;
    checker_.expectOthers(first_ns - offset_ns, last_ns - offset_ns);
  }
  /// Ends the waiting.
  CheckedEvents finish();

  std::int64_t offsetNs() const { return calibration_.time_offset_ns; }
  /// Returns the time of the first event that waits; kMaxTimeNs if there is none.
  std::int64_t waitsSinceNs() const { return checker_.waitsSinceNs(); }
  /// Returns the number of events with a wrong time, and what is wrong with the first.
  std::uint64_t wrongEvents() const { return wrong_events_; }
  const std::string& firstWrong() const { return first_wrong_; }

 private:
  static void takeSettled(EventChecker& checker, std::vector<Event>& right,
                          std::vector<Event>& wrong);
  void count(const std::vector<Event>& wrong);

  int camera_;
  RigCamera calibration_;
  EventChecker checker_;
  std::uint64_t wrong_events_ = 0;
  std::string first_wrong_;
};

}  // namespace efm
