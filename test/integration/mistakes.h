// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// A recording as a dataset folder, in memory: for tests that change one thing about it.
struct DraftRecording {
  /// Adds a line of text for an event.
  using EventLine = void (*)(const Event&, std::string& text);

  std::vector<std::vector<Event>> events;  ///< Per camera.
  std::vector<StampedPose> poses;
  std::string camchain;
  EventLine event_line = usualLine;
  /// Files by their names in the folder, also instead of those that the other fields give.
  std::map<std::string, std::string> files;

  /// "1.000002000 70 216 0"
  static void usualLine(const Event& event, std::string& text);

  /// Replaces a part of the camera chain. It is a failure of the test if the chain has no such
  /// part.
  void replaceInCamchain(const std::string& part, const std::string& by);
  /// The events of a camera as text.
  std::string eventText(std::size_t camera) const;
  /// The poses as text, in the TUM format.
  std::string poseText() const;
};

/// @param folder of two cameras and poses, without depth maps.
DraftRecording readDraft(const std::filesystem::path& folder);

/// Writes the folder. @param base what `readDraft` read: files without a change become links to its
/// files.
void writeDraft(const DraftRecording& draft, const DraftRecording& base,
                const std::filesystem::path& base_folder, const std::filesystem::path& folder);

/// A deliberate mistake in a recording or on the command line, and what `map` says of it.
struct Mistake {
  const char* name;
  std::function<void(DraftRecording&)> make;
  /// The beginning of each line on stderr, behind "event-fusion: ". A number behind ~ is met within
  /// a fifth; a line with # is expected twice, with 0 and 1. "…" as the last one: others may
  /// follow. With an error the exit status is 1, otherwise 0.
  std::vector<std::string> lines;
  std::string arguments{};  ///< Of `map`, further ones.
};

/// The lines where poses and events are never at the same time, with others.
/// @param spans of the events and of the poses, the hint of the warning, the seconds between both.
inline std::vector<std::string> apart(const std::array<std::string, 4>& spans,
                                      std::vector<std::string> lines = {}) {
  const auto& [events, poses, hint, gap_s] = spans;
  lines.push_back(
      "warning: clock-overlap: the poses cover 0.0 % of the events' time: events from " + events +
      ", poses from " + poses + hint);
  lines.push_back("error: there is no keyframe: the events span " + events + ", the poses " +
                  poses + ": they miss each other by " + gap_s + " s");
  return lines;
}

/// Writes a file into the recording's folder.
inline std::function<void(DraftRecording&)> file(const std::string& name, const std::string& text) {
  return [name, text](DraftRecording& draft) { draft.files[name] = text; };
}

std::vector<Mistake> calibrationMistakes();
std::vector<Mistake> poseMistakes();
std::vector<Mistake> eventMistakes();
std::vector<Mistake> commandMistakes();

}  // namespace efm
