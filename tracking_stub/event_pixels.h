// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/event.h"

namespace efm {

/// From one frame to the next.
struct FrameStep {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
};

/// The pixels of an event camera: each remembers the log intensity of its last event and fires
/// whenever it has changed by the contrast threshold since (Ghosh and Gallego 2022, Eq. 1). Ideal
/// pixels: one threshold for all, no noise, no refractory time.
class EventPixels {
 public:
  /// @param contrast_threshold in log intensity, above 0.
  EventPixels(int width, int height, double contrast_threshold);

  /// The pixels' memory when the recording starts: within the threshold of what they see, at
  /// random, as it is for pixels that have been running; or, without a seed, exactly what they see.
  void start(const cv::Mat1f& log_intensity);
  void start(const cv::Mat1f& log_intensity, std::uint64_t seed);

  /// Appends the events of one row of pixels, by column and then in order of time. Log intensity
  /// changes linearly in the step; times are rounded to whole microseconds. Rows are independent:
  /// they may be fired by different threads.
  void fireRow(int y, const FrameStep& step, const cv::Mat1f& before, const cv::Mat1f& after,
               std::vector<Event>& events);

 private:
  float threshold_;
  cv::Mat1f last_;  // log intensity at each pixel's last event
};

}  // namespace efm
