// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// The time from one frame to the next.
struct FrameStep {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
};

/// The default is an ideal pixel.
struct EventPixelOptions {
  /// Min of both thresholds. Real sensors have 0.1 or more. Lower thresholds make more events and
  /// take more time.
  static constexpr double kMinThreshold = 0.01;

  double threshold_on = 0.3;   ///< Increase of log intensity for an event, 0.01 or more.
  double threshold_off = 0.3;  ///< Decrease of log intensity for an event, 0.01 or more.
  /// Standard deviation of a factor on both thresholds of each pixel, 0 to 0.5. Real sensors have
  /// 0.02 to 0.1. The min factor is 0.2.
  double mismatch = 0;
  /// A pixel is blind for this time after an event, 0 to 1 s. Its memory is then the current
  /// intensity.
  std::int64_t refractory_ns = 0;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The pixels of an event camera. Each remembers the log intensity of its last event and fires when
/// the log intensity has changed by the contrast threshold (Ghosh and Gallego 2022, Eq. 1).
class EventPixels {
 public:
  /// @param seed of the mismatch.
  /// @throws std::invalid_argument where the options are not valid.
  EventPixels(int width, int height, const EventPixelOptions& options, std::uint64_t seed = 0);

  /// Sets the pixels' memory at the start of the recording. With a seed it is random within the
  /// threshold of the current intensity, as in a running camera. Without a seed it is the current
  /// intensity.
  void start(const cv::Mat1f& log_intensity);
  void start(const cv::Mat1f& log_intensity, std::uint64_t seed);

  /// Appends the events of one row, by column and then by time. Log intensity changes linearly in
  /// the step. Times are rounded to whole microseconds. A step begins at the end of the previous
  /// one. Different threads may call it for different rows.
  void fireRow(int y, const FrameStep& step, const cv::Mat1f& before, const cv::Mat1f& after,
               std::vector<Event>& events);

 private:
  float thresholdAt(int y, int x, bool brighter) const {
    return factor_.empty() ? (brighter ? on_ : off_) : (brighter ? on_ : off_) * factor_(y, x);
  }

  float on_;
  float off_;
  std::int64_t refractory_ns_;
  cv::Mat1f factor_;                       // of both thresholds; empty where all are 1
  cv::Mat1f last_;                         // log intensity at each pixel's last event
  std::vector<std::int64_t> blind_until_;  // row-major; empty without a refractory period
};

}  // namespace efm
