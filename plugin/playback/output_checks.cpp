// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/output_checks.h"

#include <algorithm>
#include <stdexcept>
#include <system_error>

namespace efm {
namespace {

namespace fs = std::filesystem;

/// Returns a path with all links followed, in its existing part.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  if (error) whole = path;
  return whole.has_filename() ? whole : whole.parent_path();
}

bool isSame(const fs::path& one, const fs::path& other) {
  std::error_code missing;
  return fs::equivalent(one, other, missing);
}

bool isBelow(const fs::path& path, const fs::path& folder) {
  const auto end = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first;
  return end == folder.end();
}

/// Returns the file in a folder that links to an input; empty if there is none.
fs::path linkTo(const fs::path& input, const fs::path& folder) {
  std::error_code unreadable;
  const auto skip = fs::directory_options::skip_permission_denied;
  for (fs::recursive_directory_iterator entry(folder, skip, unreadable), end;
       !unreadable && entry != end; entry.increment(unreadable)) {
    if (isSame(entry->path(), input)) return entry->path();
  }
  return {};
}

}  // namespace

std::vector<fs::path> inputsOf(const RecordingSource& source) {
  std::vector<fs::path> inputs = source.files;
  inputs.insert(inputs.end(), {source.poses, source.calibration, source.hand_eye});
  return inputs;
}

void rejectReplacing(const fs::path& out, const std::vector<fs::path>& inputs) {
  std::error_code ignored;
  if (!fs::exists(out, ignored)) return;
  const bool is_folder = fs::is_directory(out, ignored);
  for (const fs::path& input : inputs) {
    if (input.empty() || !fs::exists(input, ignored)) continue;
    const auto reject = [&](const fs::path& replaced, const char* why) {
      return std::runtime_error(replaced.string() + why + input.string() +
                                " itself: expected another " + (is_folder ? "folder" : "file") +
                                " for the results");
    };
    if (isSame(input, out)) throw reject(out, ": it is the input ");
    if (!is_folder) continue;
    if (isBelow(resolved(input), resolved(out))) throw reject(out, ": it holds the input ");
    const fs::path link = linkTo(input, out);
    if (!link.empty()) throw reject(link, ": it is the input ");
  }
}

}  // namespace efm
