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

/// A deliberate mistake in a recording or on the command line, and the words that name it. A new
/// row needs a name, a change and the words.
struct Mistake {
  const char* name;
  std::function<void(DraftRecording&)> make;
  std::string arguments;  ///< Of `map`, further ones.
  int status;
  std::vector<std::string> words;  ///< On stderr. "warning: NAME:" is a named warning.
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
