// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_formats.h"

#include <fmt/format.h>

#include <stdexcept>
#include <system_error>

#include "plugin/recordings/columns/event_arrays.h"
#include "plugin/recordings/streams/file_content.h"
#include "plugin/recordings/text/pose_text.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

/// The first bytes of the content; nothing of what cannot be read.
std::string firstBytes(const fs::path& file) {
  constexpr std::size_t kBytes = 4096;
  std::string bytes(kBytes, '\0');
  FileContent content(file);
  bytes.resize(content.read(bytes.data(), kBytes));
  return bytes;
}

void refuseUnread(const fs::path& file) {
  if (isCompressed(file) || fs::is_directory(file)) return;
  if (const auto unread = unreadFormat(file)) {
    throw std::runtime_error(file.string() + ": " + *unread);
  }
}

std::vector<StampedPose> posesOfRecording(const fs::path& file, ReaderOptions options) {
  const RecordingFormat* const format = detectFormat(file);
  if (format == nullptr) {
    refuseUnread(file);
    throw std::runtime_error(file.string() +
                             ": not a file of poses: expected text (t tx ty tz qx qy qz qw, or "
                             "columns with a header), NumPy arrays, or a recording with poses");
  }
  options.topics_of_other_files = true;  // they are those of the events, too
  RecordingParts parts = format->open({file}, options);
  if (!parts.poses_damage.empty()) throw std::runtime_error(parts.poses_damage);
  if (!parts.poses.empty()) return std::move(parts.poses);
  throw std::runtime_error(
      fmt::format("{}: no poses: expected {}", file.string(), parts.expected_poses));
}

std::vector<StampedPose> readAnyPoses(const fs::path& file, const ReaderOptions& options) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) return posesOfRecording(file, options);
  if (looksLikeNumpy(file)) return readPoseArrays(file, options);
  const std::string start = firstBytes(file);
  requireTextLines(start, file.string());
  if (start.find('\0') != std::string::npos) return posesOfRecording(file, options);
  if (start.compare(0, 8, "#ROSBAG ") == 0) return posesOfRecording(file, options);
  refuseUnread(file);
  return readPoseText(file, options);
}

}  // namespace

std::vector<StampedPose> readPoses(const fs::path& file, const ReaderOptions& options) {
  std::vector<StampedPose> poses = readAnyPoses(file, options);
  if (!poses.empty()) return poses;
  throw std::runtime_error(file.string() +
                           ": no poses: expected at least one line t tx ty tz qx qy qz qw");
}

}  // namespace efm
