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

/// A recording as a dataset folder, in memory. Tests change one thing in it.
struct DraftRecording {
  /// Adds a line of text for an event.
  using EventLine = void (*)(const Event&, std::string& text);

  std::vector<std::vector<Event>> events;  ///< Per camera.
  std::vector<StampedPose> poses;
  std::string camchain;
  EventLine event_line = usualLine;
  /// Contents of files by their names in the folder. They replace files that the other fields give.
  std::map<std::string, std::string> files;

  /// Adds a line "1.000002000 70 216 0".
  static void usualLine(const Event& event, std::string& text);

  /// Replaces a part of the camera chain. The test fails if the chain does not contain the part.
  void replaceInCamchain(const std::string& part, const std::string& by);
  /// Returns the events of a camera as text.
  std::string eventText(std::size_t camera) const;
  /// Returns the poses as text in the TUM format.
  std::string poseText() const;
};

/// Reads a dataset folder. @param folder of two cameras and poses, without depth maps.
DraftRecording readDraft(const std::filesystem::path& folder);

/// Writes the folder. @param base the draft that `readDraft` returned: files that did not change
/// become links to the files of `base_folder`.
void writeDraft(const DraftRecording& draft, const DraftRecording& base,
                const std::filesystem::path& base_folder, const std::filesystem::path& folder);

/// A deliberate mistake in a recording or on the command line, and the messages of `map` about it.
struct Mistake {
  const char* name;
  std::function<void(DraftRecording&)> make;
  /// Expected lines on stderr: the beginning of each, without "event-fusion: ". A number after ~
  /// may differ by a fifth. A line with # is expected twice, with 0 and 1. If "…" is the last line,
  /// others may follow. The exit status is 1 if a line is an error, otherwise 0.
  std::vector<std::string> lines;
  std::string arguments{};  ///< Additional arguments of `map`.
};

/// Returns `lines` and the messages about poses and events that are never at the same time.
/// @param spans times of the events, of the poses, hint of the warning, seconds between the times.
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

/// Returns a change that writes a file into the recording's folder.
inline std::function<void(DraftRecording&)> file(const std::string& name, const std::string& text) {
  return [name, text](DraftRecording& draft) { draft.files[name] = text; };
}

std::vector<Mistake> calibrationMistakes();
std::vector<Mistake> poseMistakes();
std::vector<Mistake> eventMistakes();
std::vector<Mistake> commandMistakes();

}  // namespace efm
