// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path) : OutputFile(path, path) {}
  /// @param name name of the complete file, for errors.
  OutputFile(const std::filesystem::path& path, std::filesystem::path name);

  std::ofstream& stream() { return stream_; }
  /// @throws std::runtime_error naming the file if it could not be written, and the reason if the
  /// last write failed.
  void requireWritten() const;
  /// @throws std::runtime_error as `requireWritten`.
  void close();

 private:
  std::filesystem::path name_;
  std::ofstream stream_;
};

/// Writes poses.txt in TUM format. If there is no pose, there is no file.
class PoseTextFile {
 public:
  explicit PoseTextFile(std::filesystem::path path) : path_(std::move(path)) {}

  void add(const StampedPose& pose);
  void close();

 private:
  std::filesystem::path path_;
  std::unique_ptr<OutputFile> file_;
};

/// Writes camchain.yaml, if the cameras are calibrated.
void writeCamchain(const std::filesystem::path& folder, const Rig& rig);

/// Writes a recording in a format of other tools, in constant memory. Results get their names when
/// `close` is called. If it is not called, nothing is left.
class RecordingWriter {
 public:
  virtual ~RecordingWriter() = default;

  /// @param camera index in the rig.
  /// @param events in time order, not before the camera's earlier events. Times are in ns of the
  /// recording's clock, with the camera's time offset already added.
  virtual void addEvents(std::size_t camera, const std::vector<Event>& events) = 0;
  /// @param pose T_world_rig; poses come in time order.
  virtual void addPose(const StampedPose& pose) = 0;
  /// Adds a depth map of camera 0: a float32 TIFF file in metres. Most formats ignore it.
  virtual void addTruth(std::int64_t /*t_ns*/, const std::filesystem::path& /*file*/) {}
  virtual void close() = 0;
};

/// Writes a dataset folder: camN/events.txt, camchain.yaml, poses.txt (T_world_cam0); depth/ with
/// the truth. Parts that the recording does not have are left out.
/// @param rig rig whose frame is camera 0's frame.
/// @throws std::runtime_error naming the folder if it exists and is not empty, or cannot be made.
std::unique_ptr<RecordingWriter> openFolderWriter(const std::filesystem::path& folder,
                                                  const Rig& rig);

/// Writes an MCAP file as rosbag2 has it (CDR messages, ros2msg schemas, zstd chunks of 1 MiB,
/// index and checksums):
///   /camN/events       event_camera_msgs/EventPacket, encoding mono: the times are exact (ns), and
///                      event_camera_py and our reader decode it
///   /camN/camera_info  sensor_msgs/CameraInfo, once, if the camera is calibrated
///   /pose              geometry_msgs/PoseStamped, T_world_rig
/// The cameras' poses on the rig have no message: a rig of several cameras needs a calibration
/// file. Times that a ROS message cannot hold (before 0, or from 2^31 s on), and rows above 32767,
/// are errors.
/// @param rig rig whose frame is the poses' frame.
std::unique_ptr<RecordingWriter> openMcapWriter(const std::filesystem::path& file, const Rig& rig);

}  // namespace efm
