// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/hwdrivers/CGenericSensor.h>
#include <mrpt/system/COutputLogger.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "plugin/player/player_options.h"
#include "plugin/player/recording_player.h"

namespace efm {

/// A sensor of MRPT that plays a recording of any format in real time, faster or slower: a live
/// source for rawlog-grabber and other hosts, which make it by the name "CEventPlayer". The README
/// of this folder has its options.
///
/// The play begins with the first call of `doProcess`. No observation comes before its time; see
/// RecordingPlayer. When `max_queue_len` observations wait for `getObservations`, the player waits,
/// too, and then plays what it owes as fast as the host takes it: it is late, but loses nothing.
/// (MRPT 2.5.8 reads `max_queue_len` and lets the queue grow.)
///
/// A pause of the recording of more than 10 s is logged when it begins: it may come from poses on
/// another clock. At the end the player logs how many observations there were and how late the
/// latest one was. A CObservationComment with this text follows the last observation, and then
/// nothing. Has no thread of its own: `doProcess` reads the recording.
class CEventPlayer : public mrpt::system::COutputLogger, public mrpt::hwdrivers::CGenericSensor {
  DEFINE_GENERIC_SENSOR(CEventPlayer)

 public:
  CEventPlayer();
  ~CEventPlayer() override;

  /// Opens the recording. @throws std::exception as `openRecording` and RecordingPlayer do.
  void initialize() override;
  /// @throws std::runtime_error at an error of the recording, after all observations before it; the
  /// sensor's state is ssError then.
  void doProcess() override;

  /// Whether the comment at the end was delivered.
  bool ended() const { return ended_; }

 protected:
  /// @throws std::invalid_argument as `readPlayerOptions` does.
  void loadConfig_sensorSpecific(const mrpt::config::CConfigFileBase& source,
                                 const std::string& section) override;

 private:
  using Observations = std::vector<mrpt::obs::CObservation::Ptr>;

  void begin();
  std::int64_t now() const;
  Observations observationsDue(std::size_t max_count);
  void noteLongPause(std::int64_t now_ns);
  mrpt::obs::CObservation::Ptr commentAtEnd();

  PlayerOptions options_;
  std::unique_ptr<RecordingPlayer> player_;
  std::chrono::steady_clock::time_point start_;
  bool begun_ = false;
  bool ended_ = false;
  std::int64_t paused_until_ns_ = 0;  // of the long pause that was logged last
  std::int64_t shift_ns_ = 0;         // of all times
  mrpt::Clock::time_point newest_;    // of the stamps that were delivered
};

}  // namespace efm
