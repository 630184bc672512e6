// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

class MapWatcher;

class RawlogWriter {
 public:
  virtual ~RawlogWriter() = default;
  virtual void write(Sample sample) = 0;
  /// Completes the file. If it is not called, there is no file.
  virtual void close() = 0;
};

enum class RawlogCompression { kGzip, kZstd, kNone };

/// The functions of libmrpt-event-fusion.so (plugin/mrpt/). The library is loaded at the first use.
struct MrptLibrary {
  RecordingParts (*openRawlog)(const std::filesystem::path& file, const ReaderOptions& options);
  /// @param file an earlier file of this name is replaced: see AtomicFile.
  /// @param compression gzip for the whole file, MRPT's default; or Zstandard for the events only,
  /// three times as fast, in an uncompressed file.
  std::unique_ptr<RawlogWriter> (*writeRawlog)(const std::filesystem::path& file,
                                               RawlogCompression compression,
                                               const Recording& recording);
  /// See `recordFrames` (plugin/mrpt/window/map_scene.h).
  std::unique_ptr<MapWatcher> (*recordFrames)(const std::filesystem::path& folder, bool force);
  /// Returns T_world_ref of the keyframes of a .simplemap.
  /// @throws std::runtime_error naming the file.
  std::vector<StampedPose> (*readSimpleMap)(const std::filesystem::path& file);
};

/// Loads the library: from the folder of libevent-fusion.so, else with the system's search.
/// @param for_what the file or option that needs the library, for the error.
/// @throws std::runtime_error naming `for_what`, the library and why it cannot be loaded.
const MrptLibrary& mrptLibrary(const std::string& for_what);

/// Returns a symbol of a library that is found in the same way. The library is never closed.
void* symbolOf(const std::string& library, const std::string& symbol, const std::string& for_what);

}  // namespace efm
