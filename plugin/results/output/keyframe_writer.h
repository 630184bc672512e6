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
/// plane is written immediately, so the memory in use is one plane.
class NpyDsiFile : public DsiSink {
 public:
  NpyDsiFile(const std::filesystem::path& path, int planes, const ReferenceView& view);

  /// Writes a plane. Thread-safe. `finish` reports errors of the disk.
  void addPlane(int plane, const float* values) override;
  /// @return the complete file. Its `replace` gives the file its name; otherwise it is removed.
  std::unique_ptr<AtomicFile> finish();

 private:
  std::unique_ptr<AtomicFile> target_;
  std::streamoff plane_bytes_;
  std::streamoff header_bytes_ = 0;
  std::mutex mutex_;  // protects file_
  std::ofstream file_;
};

/// A run that has begun to write a folder and has no report.json yet.
struct UnfinishedRun {
  std::vector<std::string> recording;  ///< The files of the recording.
  pid_t process = 0;
};

/// The mark of an unfinished run in its folder: the file report.partial.json, with the content of
/// UnfinishedRun. The run holds a lock on the file. The lock ends with the process, so a killed run
/// can be distinguished from a run at work.
class RunMark {
 public:
  static constexpr const char* kName = "report.partial.json";

  /// Makes the mark of this process. It replaces the mark of a killed process.
  /// @throws std::runtime_error naming the folder if another run is at work in the folder or the
  /// mark cannot be made.
  RunMark(const std::filesystem::path& folder, const std::vector<std::string>& recording);
  /// Ends the lock. The file stays.
  ~RunMark();
  RunMark(const RunMark&) = delete;
  RunMark& operator=(const RunMark&) = delete;

  /// Returns the mark of a killed run, if the folder has such a mark.
  /// @throws std::runtime_error naming the folder if another run is at work in the folder.
  static std::optional<UnfinishedRun> ofKilledRun(const std::filesystem::path& folder);

 private:
  int file_ = -1;
};

/// Writes keyframes in order, in its own thread, while the caller makes the next keyframes. At most
/// one keyframe waits while another keyframe is written, so memory is bounded. After an error no
/// further keyframe is written. Only one thread may call this object.
class KeyframeWriter {
 public:
  using Write = std::function<void(const KeyframeDepthMap&)>;

  /// @param write runs in the writer's thread until `finish` returns or this object is destroyed.
  explicit KeyframeWriter(Write write);
  /// Writes the waiting keyframe, so that no keyframe is lost after an error elsewhere.
  ~KeyframeWriter();
  KeyframeWriter(const KeyframeWriter&) = delete;
  KeyframeWriter& operator=(const KeyframeWriter&) = delete;

  /// Adds a keyframe. Blocks while another keyframe waits. Shares its images: do not change them.
  /// @throws the error of an earlier keyframe.
  void add(const KeyframeDepthMap& keyframe);
  /// Waits until all keyframes are written. @throws the error of a keyframe.
  void finish();
  /// Returns the processor time of the writer's thread so far.
  double cpuSeconds() const;

 private:
  void run();

  Write write_;
  std::mutex mutex_;  // protects the members below
  std::condition_variable changed_;
  std::optional<KeyframeDepthMap> waiting_;
  bool busy_ = false;
  bool stop_ = false;
  std::exception_ptr error_;
  std::thread thread_;  // last, because it uses the other members
};

}  // namespace efm
