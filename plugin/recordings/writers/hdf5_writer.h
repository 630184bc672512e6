// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "plugin/recordings/columns/hdf5_file.h"
#include "plugin/recordings/writers/recording_writer.h"

namespace efm {

/// A list of whole numbers in an HDF5 file, which grows: chunks are compressed by Blosc with
/// Zstandard. Memory is that of a chunk.
class Hdf5List {
 public:
  /// @param type of the numbers in the file, little-endian; as long as those that are added.
  Hdf5List(hid_t file, const char* path, hid_t type);

  template <typename Number>
  void add(Number number) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&number);
    chunk_.insert(chunk_.end(), bytes, bytes + sizeof(Number));
    ++count_;
    if (chunk_.size() == chunk_bytes_) writeChunk();
  }
  /// Writes the rest. @throws std::runtime_error, as `add`, without the name of the file.
  void close();

 private:
  void writeChunk();

  Hdf5Id set_;
  std::size_t number_bytes_;
  std::size_t chunk_bytes_;
  std::vector<std::uint8_t> chunk_;
  std::vector<char> compressed_;
  std::uint64_t count_ = 0;    // numbers
  std::uint64_t written_ = 0;  // numbers
};

/// Writes a folder in DSEC's layout: events/left/events.h5, events/right/events.h5, further cameras
/// events/cam2/events.h5, …; camchain.yaml; poses.txt (T_world_cam0, TUM). A file has /events/x and
/// y (uint16), p (uint8), t (uint32, microseconds since /t_offset, the first event) and /ms_to_idx
/// (uint64: the first event of each millisecond of t). Times that are not whole microseconds, or
/// later than 2^32 microseconds (71 minutes) after the first one, are errors.
class Hdf5Writer : public RecordingWriter {
 public:
  /// @param rig whose frame is that of camera 0.
  /// @throws std::runtime_error naming the folder if it exists and is not empty, or cannot be made.
  Hdf5Writer(const std::filesystem::path& folder, const Rig& rig);

  void addEvents(std::size_t camera, const std::vector<Event>& events) override;
  void addPose(const StampedPose& pose) override;
  void close() override;

 private:
  class Camera {
   public:
    explicit Camera(std::filesystem::path path);
    void add(const Event& event);
    void close();
    const std::filesystem::path& path() const { return path_; }

   private:
    std::filesystem::path path_;
    Hdf5Id file_;
    Hdf5Id group_;
    Hdf5List x_, y_, p_, t_, index_;
    std::optional<std::int64_t> first_us_;
    std::uint64_t events_ = 0;
    std::uint64_t milliseconds_ = 0;  // in the index
  };

  NewFolder folder_;
  Hdf5Quiet quiet_;  // also while the cameras' files are closed
  std::vector<Camera> cameras_;
  PoseTextFile poses_;
};

}  // namespace efm
