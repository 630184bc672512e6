// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

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
#include "plugin/session/sample.h"

namespace efm {

/// Counts the bad events of a recording that are left out, over all its cameras, up to a limit.
class BadEvents {
 public:
  /// @param limit of `--skip-bad-events`.
  explicit BadEvents(std::uint64_t limit) : limit_(limit) {}

  /// Leaves out one more bad event.
  /// @param error the position, the value and what was expected.
  /// @throws std::runtime_error: the error and the option, where there are more than the limit.
  void skip(const std::string& error);

  std::uint64_t count() const { return count_; }
  /// The error of the first one that was found: lines that are none are found before the wrong
  /// events of their block.
  const std::string& first() const { return first_; }

 private:
  std::uint64_t limit_;
  std::uint64_t count_ = 0;
  std::string first_;
};

/// The events of one camera as a file stores them, read block by block. `EventPackets` checks and
/// sorts them: a stream only decodes.
class EventStream {
 public:
  virtual ~EventStream() = default;

  /// Replaces `events` by the next events, in the order of the file. Memory is that of a block:
  /// some ten or hundred thousand events, whatever the size of the file.
  /// @return false at the end; `events` is empty then.
  /// @throws std::runtime_error at damaged data, naming file, position, value and what was
  /// expected. `events` has the events before it. The stream is not read again.
  virtual bool read(std::vector<Event>& events) = 0;

  /// From now on a damaged event is given to `bad`, and left out, where the rest of the data can be
  /// read without it. Others do as before. `bad` outlives the stream.
  virtual void skipBadEvents(BadEvents& bad) { static_cast<void>(bad); }

  /// Continues near a time: the next block may begin with any event, but none of this time or later
  /// is left out. Called before `read`. Without an index, a stream stays at its beginning.
  virtual void seek(std::int64_t t_ns) { static_cast<void>(t_ns); }

  /// The position of an event of the last block, for errors: "cam0/events.txt:17".
  virtual std::string positionOf(std::size_t index) const = 0;
  /// The name of the file, for errors.
  virtual std::string name() const = 0;
  /// The fraction of the stream that has been read, 0 to 1.
  virtual double progress() const = 0;
  /// Where damage ends all streams of the file, `read` returns false, and this is the error: it is
  /// thrown at the recording's end. Empty: there is no damage so far.
  virtual std::string damage() const { return {}; }
  /// The sensor's name, if the file knows it.
  virtual std::string label() const { return {}; }
  /// See `EventPacket`.
  virtual std::shared_ptr<const void> original() const { return nullptr; }
  /// The sensor's pixels, if the file knows them.
  virtual std::optional<CameraSize> size() const { return std::nullopt; }
  /// The gaps in the numbers of the file's packets: how many are missing, as far as known.
  virtual std::uint64_t lostPackets() const { return 0; }
  /// Events that were left out because their time or row is not known: those before the sensor's
  /// first words of time, and those after a gap. Not those before the time of `seek`.
  virtual std::uint64_t undatedEvents() const { return 0; }
  /// What the reader concluded from the values, where the file does not say it: `time-unit`,
  /// `event-columns`.
  virtual std::vector<Warning> warnings() const { return {}; }
};

/// A depth map of the truth.
struct TruthDepth {
  std::int64_t t_ns = 0;
  std::filesystem::path file;  ///< float32 TIFF: z-depth in metres in camera 0's undistorted view.
};

/// What a rawlog holds beside events and poses.
class OtherStream {
 public:
  virtual ~OtherStream() = default;
  /// @return std::nullopt at the end, or at damage: the events' streams have the error.
  virtual std::optional<OtherSample> next() = 0;
};

/// What a reader finds in the files of a recording. All parts may be missing: other sources, or
/// files of their own, may have them.
struct RecordingParts {
  std::vector<std::unique_ptr<EventStream>> cameras;
  /// The recording's own calibration, of all cameras.
  std::optional<Calibration> calibration;
  /// The sensors' size where neither the stream nor a calibration knows it.
  std::optional<CameraSize> default_size;

  std::vector<StampedPose> poses;        ///< T_world_body, in any order.
  std::vector<PoseSample> pose_samples;  ///< In place of `poses`, of a rawlog.
  /// Poses and calibration went through MRPT's classes: see `roundedPose`.
  bool rounded = false;
  std::unique_ptr<OtherStream> others;  ///< Of a rawlog; null: none.
  /// The error of the damage behind `poses`; empty: they are all.
  std::string poses_damage;

  std::vector<Warning> warnings;  ///< Which files were taken for the parts.

  /// What the format calls its missing parts, for errors: "calib.txt".
  std::string expected_calibration = "a calibration in the recording";
  std::string expected_poses = "poses in the recording";
};

/// Choices that a reader cannot find in the file.
struct ReaderOptions {
  /// Topics of bags, or names of streams, to read: events (one per camera, in the order of the
  /// cameras) and poses. Empty: found by their type.
  std::vector<std::string> topics;
  /// The columns of text events and arrays, e.g. "x y p t", `-` for one to ignore. Empty: those of
  /// the header, else t x y p. Or the names of arrays, fields or data sets: "t=a x=b y=c p=d".
  std::string columns;
  /// The unit of times in text events and NumPy arrays, and of real times in HDF5: s, ms, us or ns.
  /// Empty: found, else s.
  std::string time_unit;
  /// The pixels of all sensors, where neither the recording nor a calibration has them.
  std::optional<CameraSize> sensor_size{};
  bool keep_originals = false;  ///< Whether poses of a rawlog have theirs: see PoseSample.
  /// Whether `topics` may have names of other files. Otherwise an unknown name is an error.
  bool topics_of_other_files = false;
};

/// A family of formats. A new one is a row of the table in recording_formats.cpp.
struct RecordingFormat {
  std::string name;         ///< Of `--format`.
  std::string description;  ///< For errors.
  /// Whether a file or folder has this format, by its content. Never throws.
  bool (*matches)(const std::filesystem::path&);
  /// Opens the files of one recording, at least one. Cameras are in the order of the files.
  RecordingParts (*open)(const std::vector<std::filesystem::path>& files, const ReaderOptions&);
  /// The depth maps of a source's truth, in the order of its list; null where the format has none.
  std::vector<TruthDepth> (*truth)(const std::filesystem::path& source) = nullptr;
};

/// Whether it is a regular file, or a link to one. Never throws.
inline bool isFile(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// The first bytes of a file as it is stored: fewer if it has fewer, none if it cannot be read.
inline std::string firstBytesOf(const std::filesystem::path& file, std::size_t count) {
  std::string bytes(count, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

/// Whether a regular file begins with these bytes. Never throws.
inline bool beginsWith(const std::filesystem::path& file, std::string_view start) {
  return isFile(file) && firstBytesOf(file, start.size()) == start;
}

/// @throws std::runtime_error naming the cure, where a text is UTF-16 or has CR alone for line
/// ends.
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

/// @throws std::runtime_error where it is a pipe.
inline void requireNoPipe(const std::filesystem::path& path) {
  if (!std::filesystem::is_fifo(path)) return;
  throw std::runtime_error(path.string() +
                           ": a pipe: expected a file, as it is read more than once "
                           "(cat <PIPE >FILE writes one)");
}

/// @param what the format, for the error.
inline const std::filesystem::path& onlySource(const std::vector<std::filesystem::path>& sources,
                                               const char* what) {
  if (sources.size() == 1) return sources.front();
  throw std::runtime_error(fmt::format("{}: {} sources: expected one, {}", sources.at(1).string(),
                                       sources.size(), what));
}

}  // namespace efm
