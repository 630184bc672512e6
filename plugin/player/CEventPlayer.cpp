// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/player/CEventPlayer.h"

#include <fmt/format.h>
#include <mrpt/obs/CObservationComment.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/registration.h"
#include "plugin/recordings/open/open_recording.h"

IMPLEMENTS_GENERIC_SENSOR(CEventPlayer, efm)

namespace efm {
namespace {

using mrpt::obs::CObservation;

constexpr double kLongPauseS = 10;

/// What the recording lacks; empty if nothing.
std::string lossesOf(const RecordingCounts& counts) {
  std::string losses;
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) losses += fmt::format("{}{} {}", losses.empty() ? "" : ", ", count, what);
  };
  add(counts.skipped_events, "bad events left out");
  add(counts.undated_events, "events without a time left out");
  add(counts.lost_packets, "packets missing");
  return losses;
}

/// Registers at load, with the observations.
const struct AtLoad {
  AtLoad() {
    registerClasses();
    CEventPlayer::doRegister();
  }
} kAtLoad;

}  // namespace

CEventPlayer::CEventPlayer() : COutputLogger("CEventPlayer") {}
CEventPlayer::~CEventPlayer() = default;

void CEventPlayer::loadConfig_sensorSpecific(const mrpt::config::CConfigFileBase& source,
                                             const std::string& section) {
  options_ = readPlayerOptions(source, section);
}

void CEventPlayer::initialize() {
  if (options_.source.files.empty()) {
    throw std::logic_error("CEventPlayer: initialize without options: expected loadConfig before");
  }
  m_state = ssInitializing;
  begun_ = ended_ = false;
  player_ = std::make_unique<RecordingPlayer>(openRecording(options_.source),
                                              options_.source.faults.latency_ns);
  m_state = ssWorking;
}

void CEventPlayer::begin() {
  begun_ = true;
  start_ = std::chrono::steady_clock::now();
  shift_ns_ = 0;
  newest_ = {};
  paused_until_ns_ = player_->startNs();
  if (options_.restamp == Restamp::kNow) {
    const std::int64_t first_ns = nanosecondsFrom(mrptTimeFrom(player_->startNs()));
    shift_ns_ = nanosecondsFrom(mrpt::Clock::now()) - first_ns;
  }
  MRPT_LOG_INFO(fmt::format("plays {} from {} s on, at {} times its speed", options_.recording,
                            formatSeconds(player_->startNs()), options_.speed));
}

/// On the recording's clock.
std::int64_t CEventPlayer::now() const {
  const auto elapsed = std::chrono::steady_clock::now() - start_;
  const auto elapsed_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(elapsed).count();
  return player_->startNs() +
         static_cast<std::int64_t>(options_.speed * static_cast<double>(elapsed_ns));
}

void CEventPlayer::doProcess() {
  if (!player_) {
    throw std::logic_error("CEventPlayer: doProcess before initialize");
  }
  if (ended_) return;
  if (!begun_) begin();
  // MRPT's queue does not tell its length: it is emptied and filled again, in the same order.
  std::vector<mrpt::serialization::CSerializable::Ptr> queue;
  for (auto& entry : getObservations()) queue.push_back(std::move(entry.second));
  try {
    if (queue.size() < m_max_queue_len) {
      for (auto& observation : observationsDue(m_max_queue_len - queue.size())) {
        queue.push_back(std::move(observation));
      }
    }
  } catch (const std::exception&) {
    m_state = ssError;
    appendObservations(queue);
    throw;
  }
  if (player_->ended()) queue.push_back(commentAtEnd());
  appendObservations(queue);
}

CEventPlayer::Observations CEventPlayer::observationsDue(std::size_t max_count) {
  const std::int64_t now_ns = now();
  Observations observations = player_->observationsUntil(now_ns, max_count);
  noteLongPause(now_ns);
  for (const CObservation::Ptr& observation : observations) {
    if (shift_ns_ != 0) shiftTimes(*observation, shift_ns_);
    newest_ = std::max(newest_, observation->timestamp);
  }
  return observations;
}

void CEventPlayer::noteLongPause(std::int64_t now_ns) {
  const std::optional<std::int64_t> next_ns = player_->nextNs();
  if (!next_ns || *next_ns == paused_until_ns_) return;
  const double pause_s = secondsBetween(now_ns, *next_ns) / options_.speed;
  if (pause_s < kLongPauseS) return;
  paused_until_ns_ = *next_ns;
  MRPT_LOG_WARN(fmt::format("{}: nothing comes for {:.0f} s, until {} s on the recording's clock",
                            options_.recording, pause_s, formatSeconds(*next_ns)));
}

/// Its stamp is the newest: rawlog-grabber sorts by stamps, and never writes the last observation.
CObservation::Ptr CEventPlayer::commentAtEnd() {
  ended_ = true;
  const std::string text = fmt::format(
      "the end of {}: {} observations, at most {:.3f} s late", options_.recording,
      player_->returned(), static_cast<double>(player_->maxDelayNs()) * 1e-9 / options_.speed);
  const std::string losses = lossesOf(player_->counts());
  MRPT_LOG_INFO(text);
  if (!losses.empty()) MRPT_LOG_WARN(options_.recording + ": " + losses);
  auto comment = mrpt::obs::CObservationComment::Create();
  comment->sensorLabel = m_sensorLabel;
  comment->timestamp = newest_ + mrpt::Clock::duration(1);
  comment->text = losses.empty() ? text : text + "; " + losses;
  return comment;
}

}  // namespace efm
