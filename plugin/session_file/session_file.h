// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "plugin/recordings/writers/mcap_file.h"

namespace efm {

/// An open file that is closed.
class FileHandle {
 public:
  /// @param flags of open(2). @throws std::runtime_error naming the file.
  FileHandle(std::filesystem::path path, int flags);
  ~FileHandle();
  FileHandle(const FileHandle&) = delete;
  FileHandle& operator=(const FileHandle&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const;
  /// Keeps the file from other writers, until it is closed, if the file system can do that.
  /// @throws std::runtime_error naming the file if another program has it.
  void lock();
  /// Returns bytes; fewer at the end of the file. @throws std::runtime_error naming the file.
  std::string read(std::uint64_t position, std::uint64_t size) const;
  /// Cuts the file at a position, appends bytes there, and waits until the disk has them. After an
  /// error the file ends at the position, if the disk allows it.
  /// @throws std::runtime_error naming the file, and that the disk is full.
  void append(std::uint64_t position, const std::string& bytes);

 private:
  std::filesystem::path path_;
  int file_;
};

/// The file of a map, for reading: all keyframes that it is made from, and how (docs/session.md).
/// MCAP, one chunk per keyframe. The file only grows, so a crash costs at most the chunk in the
/// making. Thread-safe.
class SessionFile {
 public:
  /// Finds the chunks: by the index, or if the run did not end, from the begin to the first byte
  /// that is not whole.
  /// @throws std::runtime_error naming the file if it cannot be read, is no session file, or is of
  /// a newer version.
  explicit SessionFile(const std::filesystem::path& path);
  /// Returns whether a file is a session file of any version.
  static bool is(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return file_.path(); }
  /// Returns how the map was made (docs/session.md, "run"); an empty object if the run ended before
  /// its first keyframe.
  const nlohmann::ordered_json& run() const { return run_; }
  std::size_t keyframes() const { return keyframes_.size(); }
  /// Reads a keyframe. T_world_ref is the pose when it was made.
  /// @throws std::runtime_error naming the file and the byte.
  KeyframeDepthMap keyframe(std::size_t number) const;
  /// Returns T_world_ref of the keyframes at t_ref.
  /// @param refined true: the newest generation. false: by the tracker.
  std::vector<StampedPose> poses(bool refined) const;
  /// Returns the number of generations of corrected poses.
  std::size_t generations() const { return poses_.size(); }
  /// Returns the content of report.json; empty if the run did not end.
  std::string report() const;
  /// Returns whether the run mapped its recording to the end.
  bool isComplete() const;
  /// Returns why the end of the file is not used: "byte 4117: …"; empty if it is whole.
  const std::string& damage() const { return damage_; }

 private:
  friend class SessionWriter;
  struct Chunk {
    std::uint64_t position = 0;
    McapChunk fields;
    std::uint64_t record_size = 0;
    std::string records;  // not compressed
  };

  bool readIndex();
  void scan();
  void noteChannel(McapRecord& record);
  void note(int channel, std::uint64_t chunk);
  std::optional<std::pair<McapOp, std::uint64_t>> headAt(std::uint64_t position) const;
  Chunk chunkAt(std::uint64_t position) const;
  std::string messageIn(const Chunk& chunk, int channel) const;

  FileHandle file_;
  nlohmann::ordered_json run_ = nlohmann::ordered_json::object();
  std::map<std::uint16_t, int> channels_;         // by their numbers in the file
  std::vector<std::uint64_t> keyframes_, poses_;  // chunks
  std::optional<std::uint64_t> run_chunk_, report_;
  std::string damage_;
};

/// Writes a session file. After each keyframe the file is on the disk.
class SessionWriter {
 public:
  /// Begins a new file. @param run see SessionFile::run.
  SessionWriter(const std::filesystem::path& path, const nlohmann::ordered_json& run);
  /// Goes on with a file after some of its keyframes; what follows them is cut.
  SessionWriter(const SessionFile& earlier, std::size_t keyframes);

  /// @throws std::runtime_error naming the file; what was stored stays whole.
  void add(const KeyframeDepthMap& keyframe);
  /// Adds a generation of poses, one per keyframe.
  void addPoses(const std::vector<StampedPose>& T_world_ref);
  /// Adds the report and the index.
  void finish(const std::string& report_json);
  /// Adds a generation of poses to a file, one per keyframe; all else stays.
  /// @throws std::runtime_error naming the file; also if another program writes it.
  static void addGeneration(const std::filesystem::path& path,
                            const std::vector<StampedPose>& T_world_ref);

  std::uint64_t bytes() const { return mcap_.position(); }
  double seconds() const { return seconds_; }  ///< Of `add`, with the waits for the disk.

 private:
  SessionWriter(const std::filesystem::path& path, int flags);
  void take(const SessionFile& file, const std::vector<std::uint64_t>& chunks);

  FileHandle file_;
  McapFile mcap_;
  double seconds_ = 0;
};

}  // namespace efm
