// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// From one frame to the next.
struct FrameStep {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
};

/// The default is the ideal pixel.
struct EventPixelOptions {
  /// Of both thresholds. Real sensors have 0.1 or more; events, and the time to make them, grow as
  /// thresholds shrink.
  static constexpr double kMinThreshold = 0.01;

  double threshold_on = 0.3;   ///< Log intensity, 0.01 or more: brighter by this fires.
  double threshold_off = 0.3;  ///< Log intensity, 0.01 or more: darker by this fires.
  /// How thresholds differ from pixel to pixel: the standard deviation of a factor on both, 0 to
  /// 0.5. Real sensors have 0.02 to 0.1. No pixel's factor is below 0.2.
  double mismatch = 0;
  /// So long after an event a pixel sees nothing, 0 to 1 s; then it starts from what it sees.
  std::int64_t refractory_ns = 0;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The pixels of an event camera: each remembers the log intensity of its last event and fires
/// whenever it has changed by the contrast threshold since (Ghosh and Gallego 2022, Eq. 1).
class EventPixels {
 public:
  /// @param seed of the mismatch.
  /// @throws std::invalid_argument where the options are not valid.
  EventPixels(int width, int height, const EventPixelOptions& options, std::uint64_t seed = 0);

  /// The pixels' memory when the recording starts: within the threshold of what they see, at
  /// random, as it is for pixels that have been running; or, without a seed, exactly what they see.
  void start(const cv::Mat1f& log_intensity);
  void start(const cv::Mat1f& log_intensity, std::uint64_t seed);

  /// Appends the events of one row of pixels, by column and then in order of time. Log intensity
  /// changes linearly in the step; times are rounded to whole microseconds. Steps follow each
  /// other. Rows are independent: they may be fired by different threads.
  void fireRow(int y, const FrameStep& step, const cv::Mat1f& before, const cv::Mat1f& after,
               std::vector<Event>& events);

 private:
  float thresholdAt(int y, int x, bool brighter) const {
    return factor_.empty() ? (brighter ? on_ : off_) : (brighter ? on_ : off_) * factor_(y, x);
  }

  float on_;
  float off_;
  std::int64_t refractory_ns_;
  cv::Mat1f factor_;                       // on both thresholds; empty where all are 1
  cv::Mat1f last_;                         // log intensity at each pixel's last event
  std::vector<std::int64_t> blind_until_;  // row-major; empty without a refractory period
};

}  // namespace efm
