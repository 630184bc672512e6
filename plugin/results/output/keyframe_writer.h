// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

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
  /// Ends the file. @throws std::runtime_error naming it if the disk is full.
  void finish();

 private:
  std::filesystem::path path_;
  std::streamoff plane_bytes_;
  std::streamoff header_bytes_ = 0;
  std::mutex mutex_;  // protects file_
  std::ofstream file_;
};

/// Writes keyframes in order, in its own thread, while the caller makes the next keyframes. At most
/// one keyframe waits while another keyframe is written, so memory is bounded. The thread does
/// WorkAside. After an error no
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
