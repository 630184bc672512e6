// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/events/window_data.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// A short interval of a recording, to try options and hypotheses on.
struct WindowSample {
  Window window;
  /// Per camera of the rig, in time order, on the trajectory's clock; evenly chosen where a window
  /// has more than `kMaxSampleEvents` of a camera.
  std::vector<std::vector<Event>> events;
  /// Of the window, and of half a second before and after it as far as there are poses: other
  /// clocks are tried.
  Trajectory trajectory;
};

inline constexpr std::size_t kMaxSampleEvents = 300'000;

WindowSample sampleOf(const WindowData& data);

/// The events of a sample within a window, per camera.
std::vector<EventSpan> eventsWithin(const WindowSample& sample, const Window& window);

/// The part of a sample within a time around the middle of its window, at most all of it.
WindowData middleOf(const WindowSample& sample, double duration_s);

/// Keeps some of the windows of a recording, evenly spread over it, without knowing its length:
/// where there are more than `kMaxSamples`, every second one goes.
class SpreadSamples {
 public:
  static constexpr std::size_t kMaxSamples = 8;

  /// Called with each window of a recording, in their order.
  void add(const WindowData& data);
  const std::vector<WindowSample>& samples() const { return samples_; }
  /// The samples, which this object has no more.
  std::vector<WindowSample> take() { return std::move(samples_); }

 private:
  std::vector<WindowSample> samples_;
  std::size_t step_ = 1;  // every `step_`-th window is kept
  std::size_t windows_ = 0;
};

}  // namespace efm
