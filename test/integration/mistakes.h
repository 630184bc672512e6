// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "test/integration/draft_recording.h"

namespace efm {

/// The exit status of `map`.
constexpr int kFine = 0;        // with a warning
constexpr int kJobError = 1;    // of the recording
constexpr int kUsageError = 2;  // of the command line or the option file

/// A deliberate mistake in a recording or on the command line, and what `map` says of it.
struct Mistake {
  const char* name;
  std::function<void(DraftRecording&)> make;
  std::string arguments;  ///< Of `map`, further ones.
  int status;
  /// The beginning of each line on stderr, behind "event-fusion: ". A number behind ~ is met within
  /// a fifth. "…" as the last one: others may follow from the mistake.
  std::vector<std::string> lines;
};

/// Writes a file into the recording's folder.
inline std::function<void(DraftRecording&)> file(const std::string& name, const std::string& text) {
  return [name, text](DraftRecording& draft) { draft.files[name] = text; };
}

std::vector<Mistake> calibrationMistakes();
std::vector<Mistake> poseMistakes();
std::vector<Mistake> eventMistakes();
std::vector<Mistake> commandMistakes();

}  // namespace efm
