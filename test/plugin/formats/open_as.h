// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "plugin/formats/open_recording.h"

namespace efm {

/// Opens one file or folder in a format.
inline std::unique_ptr<Recording> openAs(const std::string& format,
                                         const std::filesystem::path& path) {
  RecordingSource source;
  source.files = {path};
  source.format = format;
  return openRecording(source);
}

}  // namespace efm
