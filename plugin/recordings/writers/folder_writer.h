// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "plugin/recordings/writers/recording_writer.h"
#include "plugin/recordings/writers/text_file.h"

namespace efm {

/// Writes a dataset folder: camN/events.txt, camchain.yaml, poses.txt (T_world_cam0);
/// depth/ with the truth. What the recording lacks is left out.
class FolderWriter : public RecordingWriter {
 public:
  /// @param rig whose frame is that of camera 0.
  /// @throws std::runtime_error naming the folder if it exists and is not empty, or cannot be made.
  FolderWriter(const std::filesystem::path& folder, const Rig& rig);

  void addEvents(std::size_t camera, const std::vector<Event>& events) override;
  void addPose(const StampedPose& pose) override;
  void addTruth(std::int64_t t_ns, const std::filesystem::path& file) override;
  void close() override;

 private:
  NewFolder folder_;
  std::vector<TextFile> events_;  // per camera
  PoseTextFile poses_;
  std::unique_ptr<TextFile> truth_;  // the index, if there is any
};

}  // namespace efm
