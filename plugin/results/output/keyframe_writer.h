// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <csignal>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

/// Writes keyframes in a thread of its own, in order, beside the making of the next ones. At most
/// one keyframe waits while another is written: memory stays bounded. After an error nothing more
/// is written. One thread calls it.
///
/// A signal that ends the program (SIGINT, SIGTERM, SIGHUP) takes effect once no keyframe waits:
/// the caller's thread and those that it starts block it, and the writer's accepts it when it is
/// idle.
class KeyframeWriter {
 public:
  using Write = std::function<void(const KeyframeDepthMap&)>;

  /// @param write runs in the writer's thread until `finish` returns or this object is destroyed.
  explicit KeyframeWriter(Write write);
  /// Writes the waiting keyframes: an error elsewhere loses none.
  ~KeyframeWriter();
  KeyframeWriter(const KeyframeWriter&) = delete;
  KeyframeWriter& operator=(const KeyframeWriter&) = delete;

  /// Waits while another keyframe waits. Shares the images of the keyframe: do not change them.
  /// @throws the error of an earlier keyframe.
  void add(const KeyframeDepthMap& keyframe);
  /// Waits until all keyframes are written. @throws the error of one.
  void finish();
  /// Processor time of the writer's thread so far.
  double cpuSeconds() const;

 private:
  void run();
  void acceptSignals();
  bool endIsPending() const;

  Write write_;

  mutable std::mutex mutex_;  // of the members below
  std::condition_variable changed_;
  std::deque<KeyframeDepthMap> waiting_;
  bool busy_ = false;
  bool stop_ = false;
  std::exception_ptr error_;

  sigset_t callers_signals_{};  // blocked before
  std::thread thread_;          // last: it uses the others
};

}  // namespace efm
