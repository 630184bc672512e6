// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/open/merged_recording.h"

namespace efm {

/// Plays observations of a list; may end with an error.
class ListedRecording : public Recording {
 public:
  explicit ListedRecording(std::vector<mrpt::obs::CObservation::Ptr> observations,
                           bool breaks = false)
      : observations_(std::move(observations)), breaks_(breaks) {}
  mrpt::obs::CObservation::Ptr next() override {
    if (next_ < observations_.size()) return observations_[next_++];
    if (breaks_) throw std::runtime_error("the tape is torn");
    return nullptr;
  }
  std::string position() const override { return "entry " + std::to_string(next_); }
  double progress() const override { return 0; }
  /// The number of observations read so far.
  std::size_t read() const { return next_; }

 private:
  std::vector<mrpt::obs::CObservation::Ptr> observations_;
  bool breaks_;
  std::size_t next_ = 0;
};

}  // namespace efm
