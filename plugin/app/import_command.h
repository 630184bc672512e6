// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "plugin/formats/open_recording.h"
#include "plugin/formats/rawlog_writer.h"

namespace efm {

struct ImportArguments {
  RecordingSource source;
  std::optional<std::int64_t> t0_ns;
  std::optional<std::int64_t> t1_ns;
  std::filesystem::path out;
  RawlogCompression compression = RawlogCompression::kGzip;
};

/// `event-fusion import`: writes a recording as a rawlog. Replaces an earlier rawlog, no other
/// file.
/// @return the process's exit status.
/// @throws std::exception if the recording cannot be read to its end or the rawlog cannot be
/// written. Then there is no rawlog.
int runImport(const ImportArguments& arguments);

}  // namespace efm
