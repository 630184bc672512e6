// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recording.h"

#include <algorithm>
#include <stdexcept>

#include "plugin/datasets/dataset_folder.h"
#include "plugin/datasets/uzh_text.h"
#include "plugin/rawlog_recording.h"

namespace efm {
namespace {

using Path = std::filesystem::path;

/// One way of storing a recording. The table below is the only place that knows them all.
struct Format {
  std::string name;
  bool (*looks_like)(const Path&);
  std::unique_ptr<Recording> (*open)(const Path&);
  std::string looks;  ///< What `looks_like` looks for.
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {"rawlog", [](const Path& source) { return std::filesystem::is_regular_file(source); },
       [](const Path& source) -> std::unique_ptr<Recording> {
         return std::make_unique<RawlogRecording>(source);
       },
       "a rawlog file"},
      {"folder", looksLikeDatasetFolder, openDatasetFolder,
       "a dataset folder (camchain.yaml, cam0/events.txt, poses.txt)"},
      {"uzh", looksLikeUzhFolder, openUzhFolder,
       "a folder in the UZH layout (events.txt, groundtruth.txt, calib.txt)"},
  };
  return all;
}

}  // namespace

std::vector<std::string> recordingFormats() {
  std::vector<std::string> names = {"auto"};
  for (const Format& format : formats()) names.push_back(format.name);
  return names;
}

std::unique_ptr<Recording> openRecording(const std::vector<Path>& sources,
                                         const std::string& format) {
  if (sources.size() != 1) {
    throw std::runtime_error(std::to_string(sources.size()) + " sources: expected one");
  }
  const Path& source = sources.front();
  if (!std::filesystem::exists(source)) {
    throw std::runtime_error(source.string() + ": no such file or folder");
  }
  std::string expected;
  for (const Format& known : formats()) {
    if (format == known.name || (format == "auto" && known.looks_like(source))) {
      return known.open(source);
    }
    expected += (expected.empty() ? "" : ", ") + known.looks;
  }
  if (format != "auto") throw std::runtime_error("'" + format + "' is not a known format");
  throw std::runtime_error(source.string() + ": not a recording; expected " + expected);
}

}  // namespace efm
