// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <filesystem>

#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/open/gz_stream.h"
#include "plugin/recordings/open/recording.h"

namespace efm {

/// A rawlog, gzip-compressed or plain, read entry by entry. Its observations, also those in sensory
/// frames, come one by one. The movements of actions are composed to poses (see DeadReckoning),
/// which come before the next frame; of several poses with the same time only the last. Other
/// actions and comments are ignored.
class RawlogRecording : public Recording {
 public:
  /// @throws std::runtime_error naming the file if it cannot be opened.
  explicit RawlogRecording(std::filesystem::path file, GzSource source = GzSource::kFile);

  /// @throws std::runtime_error "stopped at entry N of FILE: reason" if the file is truncated or
  /// damaged, or has an unknown class. Entries count from 0, as in MRPT's programs. All entries
  /// before N have been returned.
  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override;
  double progress() const override { return stream_.progress(); }

 private:
  void readEntry();
  void takeActions(const mrpt::obs::CSensoryFrame& frame);
  std::string whyStopped(const std::exception& error);

  std::filesystem::path file_;
  GzInputStream stream_;
  std::uint64_t entries_ = 0;  // read so far
  std::deque<mrpt::obs::CObservation::Ptr> pending_;
  std::deque<mrpt::obs::CActionCollection::Ptr> actions_;  // before the next frame
  DeadReckoning reckoning_;
};

}  // namespace efm
