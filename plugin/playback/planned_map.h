// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/events/window.h"
#include "mapping/keyframes/mapper_counts.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Keyframes by their numbers: [begin, end).
struct KeyframeRange {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;

  std::uint64_t size() const { return end - begin; }
};

/// What a pass over all events of a recording counts. A job that reads none reports these counts.
struct EventPass {
  MapperCounts counts;  ///< Of the events, and of windows without a keyframe.
  std::optional<TimeSpan> events;
  RecordingCounts read;
  std::string error;  ///< Why the recording was not read to its end; empty: it was.
  /// A source of poses that is better than the used one, but began too late. Not in files.
  std::optional<PoseSourceId> better_source;

  /// Adds the counts to those of a run that read no events.
  void addTo(SessionStatus& status, RecordingCounts& of_recording) const;
};

/// What is known of a map before it is made: all that needs the whole recording.
struct PlannedMap {
  struct Keyframe {
    Window window;
    std::uint64_t events = 0;  ///< In the window.
  };
  nlohmann::ordered_json run;  ///< SessionFile::run.
  std::vector<Keyframe> keyframes;
  EventPass pass;
  /// Why a part of the recording cannot be read by itself: all before it changes it. Empty: it can.
  std::string from_begin;
  double read_s = 0;   ///< Real time to read the recording.
  double reach_s = 0;  ///< Real time to open it again and reach the last keyframe's events.

  std::vector<Window> windowsOf(const KeyframeRange& range) const;
  KeyframeRange all() const { return {0, keyframes.size()}; }
  /// Adds its content to a file's.
  void addTo(nlohmann::ordered_json& json) const;
  /// @throws nlohmann::json::exception if something is missing or of another type.
  static PlannedMap of(const nlohmann::ordered_json& json);
};

}  // namespace efm
