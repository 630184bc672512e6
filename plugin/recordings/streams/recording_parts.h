// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <any>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/events/event.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

/// Counts the bad events that are left out, over all cameras of a recording, up to a limit.
class BadEvents {
 public:
  /// @param limit value of `--skip-bad-events`.
  explicit BadEvents(std::uint64_t limit) : limit_(limit) {}

  /// Counts one more bad event.
  /// @param error text with the position, the value and the expected value.
  /// @throws std::runtime_error with the error and the option if the limit is exceeded.
  void skip(const std::string& error);

  /// Returns whether the next call of `skip` needs its text: describing each of many takes long.
  bool needsText() const { return count_ == 0 || count_ == limit_; }
  std::uint64_t count() const { return count_; }
  /// The error of the first bad event that was found. In a block, lines without an event are found
  /// before wrong events.
  const std::string& first() const { return first_; }

 private:
  std::uint64_t limit_;
  std::uint64_t count_ = 0;
  std::string first_;
};

/// The events of one camera as a file stores them, read block by block. `EventPackets` checks and
/// sorts the events: a stream only decodes.
class EventStream {
 public:
  virtual ~EventStream() = default;

  /// Replaces `events` by the next events, in the order of the file. Memory holds one block: some
  /// ten or hundred thousand events, whatever the size of the file.
  /// @return false at the end; `events` is empty then. False also at damage: `events` then has the
  /// events before the damage. The stream is not read again.
  bool read(std::vector<Event>& events) {
    try {
      return decode(events);
    } catch (const std::exception& error) {
      damage_ = error.what();
      return false;
    }
  }
  /// Returns the file, position, value and expected value of the damage that ended the stream;
  /// empty if there is none.
  const std::string& damage() const { return damage_; }

  /// From now on, counts a damaged event in `bad` and leaves it out if the rest of the data can be
  /// read without it. Other damage is still an error. `bad` must outlive the stream.
  virtual void skipBadEvents(BadEvents& bad) { static_cast<void>(bad); }

  /// Continues near a time. The next block may begin with earlier events, but no event of this time
  /// or later is left out. Call it before `read`. A stream without an index stays at its beginning.
  virtual void seek(std::int64_t t_ns) { static_cast<void>(t_ns); }

  /// The position of an event of the last block, for errors: "cam0/events.txt:17".
  virtual std::string positionOf(std::size_t index) const = 0;
  /// The name of the file, for errors.
  virtual std::string name() const = 0;
  /// The fraction of the stream that has been read, 0 to 1.
  virtual double progress() const = 0;
  /// Whether damage ends all streams of the file, each at the same place of the file: the others
  /// are read to it.
  virtual bool sharesDamage() const { return false; }
  /// The sensor's name, if the file has it.
  virtual std::string label() const { return {}; }
  /// The original object of the last block: see `EventPacket`.
  virtual std::shared_ptr<const void> original() const { return nullptr; }
  /// The sensor's size, if the file has it.
  virtual std::optional<CameraSize> size() const { return std::nullopt; }
  /// The number of missing packets, from gaps in the packet numbers; 0 if packets have no numbers.
  virtual std::uint64_t lostPackets() const { return 0; }
  /// The number of events without a known time or row, which are left out: events before the
  /// sensor's first time words and after a gap. Events before the time of `seek` do not count.
  virtual std::uint64_t undatedEvents() const { return 0; }
  /// A command that sorts the file's events by time; empty: there is none.
  virtual std::string commandInOrder() const { return {}; }
  /// Warnings about properties that the file does not state and that the reader concluded from the
  /// values: `time-unit`, `event-columns`.
  virtual std::vector<Warning> warnings() const { return {}; }

 protected:
  /// Reads a block: see `read`. @throws std::runtime_error at damage.
  virtual bool decode(std::vector<Event>& events) = 0;

 private:
  std::string damage_;
};

/// A picture of a list. The truth's: float32 TIFF, z-depth in metres in camera 0's undistorted
/// view.
struct TimedFile {
  std::int64_t t_ns = 0;
  std::filesystem::path file;
};

/// The objects of a rawlog other than events and poses.
class OtherStream {
 public:
  virtual ~OtherStream() = default;
  /// @return std::nullopt at the end, or at damage: the event streams have its error.
  virtual std::optional<OtherSample> next() = 0;
};

/// The parts that a reader finds in the files of a recording. Each part may be missing: another
/// source, or a separate file, may have it.
struct RecordingParts {
  std::vector<std::unique_ptr<EventStream>> cameras;
  /// The recording's own calibration of all cameras.
  std::optional<Calibration> calibration;
  /// The sensors' size if neither the stream nor a calibration has it.
  std::optional<CameraSize> default_size;

  std::vector<StampedPose> poses;        ///< T_world_body, in any order.
  std::vector<PoseSample> pose_samples;  ///< Poses of a rawlog, in place of `poses`.
  std::unique_ptr<OtherStream> others;   ///< Other objects of a rawlog; null: none.
  /// The error of damage after the last of `poses`; empty if there is no damage.
  std::string poses_damage;

  std::vector<Warning> warnings;  ///< Warnings about files and topics that were found and taken.
  std::vector<Warning> notes;     ///< What the user's files replaced, and what was left out.
  std::vector<RecordedTopic> topics;  ///< All topics of a bag, see `ReaderOptions::lists_topics`.
  std::vector<RecordedTransform> transforms;  ///< All transforms of a bag, as `topics`.

  /// The frame of each camera's events and the camera's pose T_cam0_cam by the transforms of a bag.
  struct CameraFrame {
    std::string name;  ///< Empty: not known.
    std::optional<Rigid3> T_cam0_cam;
  };
  std::vector<CameraFrame> camera_frames;

  /// If a file has the events of several cameras: how to take one of them, for errors.
  std::string one_camera;
  /// The format's names of its parts, for errors about missing parts: "calib.txt".
  std::string expected_calibration = "a calibration in the recording";
  std::string expected_poses = "poses in the recording";
};

/// The content of the files that replace parts of the rig.
struct RigSetup {
  std::optional<Calibration> calibration;
  std::optional<Rigid3> T_body_rig;  ///< Pose of the rig on the tracked body.
};

/// Reads the files that are given. @throws std::runtime_error naming a file that cannot be read.
RigSetup readRigSetup(const std::filesystem::path& calibration,
                      const std::filesystem::path& hand_eye);

/// Returns a rig with the given calibration and time offsets (one per camera, or none) instead of
/// its own, and with `roundedPose`.
Rig calibrated(Rig rig, const RigSetup& setup, const std::vector<std::int64_t>& time_offsets_ns);

/// Choices that a reader cannot find in the file.
struct ReaderOptions {
  /// Topics of bags, or names of streams, to read: events (one per camera, in the order of the
  /// cameras) and poses ("/tf:world->body" for transforms). Empty: topics are found by their type.
  std::vector<std::string> topics;
  /// The columns of text events and arrays, e.g. "x y p t", with `-` for a column to ignore; or the
  /// names of arrays, fields or data sets: "t=a x=b y=c p=d". Empty: those of the header, else t x
  /// y p.
  std::string columns;
  /// The unit of times in text events and NumPy arrays, and of floating-point times in HDF5: s, ms,
  /// us or ns. Empty: found from the values, else s.
  std::string time_unit;
  /// The unit of times in text poses whose header names none. Empty: `time_unit` for whole numbers.
  std::string pose_time_unit{};
  /// The option that gives `pose_time_unit`, for errors.
  std::string pose_unit_option = "--pose-time-unit";
  /// The size of all sensors, used if neither the recording nor a calibration has it.
  std::optional<CameraSize> sensor_size{};
  bool keep_originals = false;  ///< True if poses of a rawlog keep their originals: see PoseSample.
  /// True if `topics` may name topics of other files. Otherwise an unknown name is an error.
  bool topics_of_other_files = false;
  /// What the scan of a rawlog found, for the next opening of the same file; null: it is scanned
  /// again.
  std::shared_ptr<std::any> scan = nullptr;
  bool lists_topics = false;      ///< True if `RecordingParts::topics` is needed.
  bool leaves_out_poses = false;  ///< True if another file gives the poses.
  /// True if the user gives a hand-eye transform: a bag's transforms do not join its poses' frame
  /// to that of camera 0.
  bool has_hand_eye = false;
  /// The recording of the events, if the poses come from another bag: the frame of camera 0's
  /// events, and bags that may have transforms.
  std::string camera_frame{};
  std::vector<std::filesystem::path> events_files{};
};

/// A family of formats. A new format is a row of the table in recording_formats.cpp.
struct RecordingFormat {
  std::string name;         ///< Value of `--format`.
  std::string description;  ///< Words for errors.
  /// Returns whether the content of a file or folder has this format. Never throws.
  bool (*matches)(const std::filesystem::path&);
  /// Opens the files of one recording, at least one file. Cameras are in the order of the files.
  RecordingParts (*open)(const std::vector<std::filesystem::path>& files, const ReaderOptions&);
  /// Returns the depth maps of a source's truth, in the order of its list; null: there are none.
  std::vector<TimedFile> (*truth)(const std::filesystem::path& source) = nullptr;
};

/// Returns whether a path is a regular file or a link to a regular file. Never throws.
inline bool isFile(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// Returns the first `count` bytes of a stored file: fewer if it is shorter, none if it is
/// unreadable.
inline std::string firstBytesOf(const std::filesystem::path& file, std::size_t count) {
  std::string bytes(count, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

/// Returns whether a regular file begins with these bytes. Never throws.
inline bool beginsWith(const std::filesystem::path& file, std::string_view start) {
  return isFile(file) && firstBytesOf(file, start.size()) == start;
}

/// @throws std::runtime_error naming a command that converts the text, if the text is UTF-16 or its
/// lines end with CR alone.
inline void requireTextLines(std::string_view text, const std::string& file) {
  const auto is_wide = [&](std::size_t i) {  // the characters at i and i + 2, NULs beside them
    return text.size() > 3 && text[i] >= '\t' && text[i + 2] >= '\t' && text[1 - i] == '\0' &&
           text[3 - i] == '\0';
  };
  const std::string_view mark = text.substr(0, 2);
  std::string code = is_wide(0) ? "UTF-16LE" : is_wide(1) ? "UTF-16BE" : "";
  if (mark == "\xff\xfe" || mark == "\xfe\xff") code = "UTF-16";
  if (!code.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: a text in {}: expected UTF-8 (iconv -f {} -t UTF-8 <FILE >NEW)", file, code, code));
  }
  using std::string_view_literals::operator""sv;
  if (text.find('\r') == text.npos || text.find_first_of("\n\0"sv) != text.npos) return;
  throw std::runtime_error(
      file + ": its lines end with CR alone: expected LF or CR LF (tr '\\r' '\\n' <FILE >NEW)");
}

/// @throws std::runtime_error if the path is a pipe.
inline void requireNoPipe(const std::filesystem::path& path) {
  if (!std::filesystem::is_fifo(path)) return;
  throw std::runtime_error(path.string() +
                           ": a pipe: expected a file, as it is read more than once "
                           "(cat <PIPE >FILE writes one)");
}

/// Returns the only source, or throws. @param what words for the format, for the error.
inline const std::filesystem::path& onlySource(const std::vector<std::filesystem::path>& sources,
                                               const char* what) {
  if (sources.size() == 1) return sources.front();
  throw std::runtime_error(fmt::format("{}: {} sources: expected one, {}", sources.at(1).string(),
                                       sources.size(), what));
}

}  // namespace efm
