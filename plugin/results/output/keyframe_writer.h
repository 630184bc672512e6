// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/sweep/space_sweep.h"

namespace efm {

/// Writes the whole DSI to a NumPy file (.npy, format 1.0): float32, [plane][row][column]. Each
/// plane goes to disk at once: memory is that of one plane.
class NpyDsiFile : public DsiSink {
 public:
  NpyDsiFile(const std::filesystem::path& path, int planes, const ReferenceView& view);

  /// Thread-safe. Errors of the disk are kept for `finish`.
  void addPlane(int plane, const float* values) override;
  /// @return the complete file. Only its `replace` gives it its name; without that no file stays.
  std::unique_ptr<AtomicFile> finish();

 private:
  std::unique_ptr<AtomicFile> target_;
  std::streamoff plane_bytes_;
  std::streamoff header_bytes_ = 0;
  std::mutex mutex_;  // of file_
  std::ofstream file_;
};

/// A run that has begun to write a folder and has no report.json yet.
struct UnfinishedRun {
  std::vector<std::string> recording;  ///< Its files.
  pid_t process = 0;
};

/// The mark of an unfinished run in its folder: the file report.partial.json, with the content of
/// UnfinishedRun. The run holds a lock on it, which ends with the process: so a run that was killed
/// differs from one that is at work.
class RunMark {
 public:
  static constexpr const char* kName = "report.partial.json";

  /// Makes the mark of this process, instead of that of a killed one.
  /// @throws std::runtime_error naming the folder where another run is at work in it, or the mark
  /// cannot be made.
  RunMark(const std::filesystem::path& folder, const std::vector<std::string>& recording);
  /// Leaves the mark.
  ~RunMark();
  RunMark(const RunMark&) = delete;
  RunMark& operator=(const RunMark&) = delete;

  /// The mark of a killed run, if the folder has one.
  /// @throws std::runtime_error naming the folder where another run is at work in it.
  static std::optional<UnfinishedRun> ofKilledRun(const std::filesystem::path& folder);

 private:
  int file_ = -1;
};

/// Writes keyframes in order, in a thread of its own, while its caller makes the next ones. At most
/// one keyframe waits while another is written: memory stays bounded. After an error it writes no
/// further keyframe. One thread calls it.
class KeyframeWriter {
 public:
  using Write = std::function<void(const KeyframeDepthMap&)>;

  /// @param write runs in the writer's thread until `finish` returns or this object is destroyed.
  explicit KeyframeWriter(Write write);
  /// Writes the waiting keyframe: an error elsewhere loses none.
  ~KeyframeWriter();
  KeyframeWriter(const KeyframeWriter&) = delete;
  KeyframeWriter& operator=(const KeyframeWriter&) = delete;

  /// Waits while another keyframe waits. Shares the images of the keyframe: do not change them.
  /// @throws the error of an earlier keyframe.
  void add(const KeyframeDepthMap& keyframe);
  /// Waits until all keyframes are written. @throws the error of one.
  void finish();
  /// Processor time of the writer's thread so far.
  double cpuSeconds() const;

 private:
  void run();

  Write write_;
  std::mutex mutex_;  // of the members below
  std::condition_variable changed_;
  std::optional<KeyframeDepthMap> waiting_;
  bool busy_ = false;
  bool stop_ = false;
  std::exception_ptr error_;
  std::thread thread_;  // last: it uses the others
};

}  // namespace efm
