// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_formats.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <exception>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "plugin/recordings/bags/bag_recording.h"
#include "plugin/recordings/columns/event_arrays.h"
#include "plugin/recordings/columns/hdf5_files.h"
#include "plugin/recordings/files/file_content.h"
#include "plugin/recordings/sensors/aedat4.h"
#include "plugin/recordings/sensors/prophesee_raw.h"
#include "plugin/recordings/streams/pose_conflict.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/dataset_folder.h"
#include "plugin/recordings/text/event_text.h"
#include "plugin/recordings/text/pose_text.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using std::string_view_literals::operator""sv;

constexpr std::size_t kBeginning = 512;  // a tar archive's magic is at byte 257

constexpr const char* kOwnResult =
    "expected a recording; `event-fusion view` shows a map, `event-fusion evaluate` compares it "
    "with "
    "the truth";

struct UnreadFormat {
  std::string_view magic;
  const char* name;
  const char* instead;
  std::size_t at = 0;  // the byte at which the magic begins
};

constexpr std::string_view kBagDescription = "rosbag2_bagfile_information";

constexpr const char* kUnpack = "unpack it, and give the recording in it";
constexpr const char* kNoEvents = "expected events; pictures and videos have none";
constexpr const char* kAsText = "write its events as text, a line t x y p each, or as HDF5";
constexpr const char* kIncomplete = "copy or download it again";
constexpr const char* kConvert = "convert it to AEDAT4, or to text, a line t x y p each";

constexpr UnreadFormat kUnreadFormats[] = {
    {"version https://git-lfs"sv, "a pointer of git-LFS, not the file itself", "run git lfs pull"},
    {"% "sv, "a file of Prophesee without a line '% evt 3.0' (or 2.0, 2.1) in its header",
     "the encoding of its events is not known; give the RAW file as it was recorded"},
    {"Event Stream"sv, "an Event Stream file (.es)",
     "it is not read; of the arrays t, x, y and on that the Python package event_stream reads, "
     "np.save('events.npy', ef.events(x, y, on, t)) makes a file that is read"},
    {"#!AER-DAT1"sv, "an AEDAT 1 file", kConvert},
    {"#!AER-DAT2"sv, "an AEDAT 2 file", kConvert},
    {"#!AER-DAT3"sv, "an AEDAT 3 file", kConvert},
    {"\xd4\xc3\xb2\xa1"sv, "a network capture (PCAP)", "expected events"},
    {"\xa1\xb2\xc3\xd4"sv, "a network capture (PCAP)", "expected events"},
    {"\x4d\x3c\xb2\xa1"sv, "a network capture (PCAP)", "expected events"},
    {"\x0a\x0d\x0d\x0a"sv, "a network capture (PCAPNG)", "expected events"},
    {"\x89PNG\r\n"sv, "a PNG picture", kNoEvents},
    {"\xff\xd8\xff"sv, "a JPEG picture", kNoEvents},
    {"II*\0"sv, "a TIFF picture", kNoEvents},
    {"MM\0*"sv, "a TIFF picture", kNoEvents},
    {"AVI "sv, "an AVI video", kNoEvents, 8},
    {"ftyp"sv, "an MP4 video", kNoEvents, 4},
    {"\x1a\x45\xdf\xa3"sv, "a Matroska video", kNoEvents},
    {"7z\xbc\xaf\x27\x1c"sv, "a 7z archive", kUnpack},
    {"Rar!\x1a\x07"sv, "a RAR archive", kUnpack},
    {"PK\x03\x04"sv, "a zip archive", kUnpack},
    {"ustar"sv, "a tar archive", kUnpack, 257},
    {"PAR1"sv, "a Parquet file", kAsText},
    {"MATLAB 5.0"sv, "a MATLAB file", kAsText},
    {"MATLAB 7.3"sv, "a MATLAB file", kAsText},
    {"\x80\x02"sv, "a pickle of Python objects", kAsText},
    {"\x80\x03"sv, "a pickle of Python objects", kAsText},
    {"\x80\x04"sv, "a pickle of Python objects", kAsText},
    {"\x80\x05"sv, "a pickle of Python objects", kAsText},
    {"\x7f\x45LF"sv, "a program (ELF)", "expected a recording"},
    {"%PDF-"sv, "a PDF document", "expected a recording"},
    {"ply\n"sv, "a point cloud (PLY)", kOwnResult},
    {"# .PCD"sv, "a point cloud (PCD)", kOwnResult},
    {"<!doctype html"sv, "an HTML page", "the download failed or needs a login"},
    {"<html"sv, "an HTML page", "the download failed or needs a login"},
    {"<?xml"sv, "an XML document", "the download failed, or it is no recording"},
};

/// Formats of recordings that are read only if the file is not compressed.
constexpr UnreadFormat kReadUnpacked[] = {
    {"#ROSBAG V"sv, "a compressed ROS 1 bag", kUnpack},
    {"\x89MCAP"sv, "a compressed MCAP file", kUnpack},
    {"SQLite format 3"sv, "a compressed ROS 2 bag", kUnpack},
    {"\x89HDF\r\n"sv, "a compressed HDF5 file", kUnpack},
    {"% "sv, "a compressed file of Prophesee", kUnpack},
    {"#!AER-DAT4"sv, "a compressed AEDAT4 file", kUnpack},
};

/// Returns a text in small letters, without blanks at its beginning.
std::string asMarkup(std::string_view text) {
  std::string small;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (small.empty() && std::isspace(byte) != 0) continue;
    small += static_cast<char>(std::tolower(byte));
  }
  return small;
}

template <std::size_t N>
std::optional<std::string> nameIn(const UnreadFormat (&table)[N], const std::string& bytes) {
  const std::string markup = asMarkup(bytes);
  for (const UnreadFormat& format : table) {
    const std::string& text = format.magic.front() == '<' ? markup : bytes;
    if (text.compare(std::min(format.at, text.size()), format.magic.size(), format.magic) != 0) {
      continue;
    }
    return fmt::format("{}: {}", format.name, format.instead);
  }
  return std::nullopt;
}

/// Returns whether a file is the report.json of a run.
bool isReport(const fs::path& file) {
  constexpr std::size_t kMostBytes = 1 << 20;
  const std::string text = firstBytesOf(file, kMostBytes);
  return text.compare(0, 1, "{") == 0 && text.find("\"votes_per_second\"") != std::string::npos;
}

/// Describes a file or folder that this program writes; null for others.
const char* ownResult(const fs::path& source) {
  if (isFile(source / "report.json") && isReport(source / "report.json")) {
    return "the result of an earlier run";
  }
  if (isFile(source / "run.lock")) {
    return "the result of a run that was killed, or is not at its end yet";
  }
  if (!isFile(source)) return nullptr;
  const std::string bytes = firstBytesOf(source, kBeginning);
  if (bytes.find("name=\"generator\" content=\"event-fusion\"") != std::string::npos) {
    return "the page of a map";
  }
  return isReport(source) ? "the report of an earlier run" : nullptr;
}

std::optional<std::string> unreadFile(const fs::path& file) {
  const std::string bytes = firstBytesOf(file, kBeginning);
  if (bytes.empty()) return fmt::format("an empty file: {}", kIncomplete);
  if (bytes.size() == kBeginning && bytes.find_first_not_of('\0') == std::string::npos) {
    return fmt::format("a file of zeros: {}", kIncomplete);
  }
  if (bytes.compare(0, kBagDescription.size(), kBagDescription) == 0) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    return "the description of a ROS 2 bag: expected its folder, " + folder.string();
  }
  if (isCompressed(file)) {
    try {
      const std::string content = firstContentOf(file, kBeginning);
      if (auto name = nameIn(kReadUnpacked, content)) return name;
      if (auto name = nameIn(kUnreadFormats, content)) return name;
    } catch (const std::exception&) {  // several files, or a damaged one
    }
  }
  return nameIn(kUnreadFormats, bytes);
}

/// Describes a folder by its first file of a known kind.
std::optional<std::string> unreadFolder(const fs::path& folder) {
  constexpr std::size_t kMost = 100;  // some files of a folder of pictures are enough
  std::vector<fs::path> files;
  std::vector<std::string> recordings;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (isFile(entry.path()) && files.size() < kMost) files.push_back(entry.path());
    if (recordings.size() == kMost || !fs::is_directory(entry.path())) continue;
    if (detectFormat(entry.path()) != nullptr) recordings.push_back(entry.path().filename());
  }
  std::sort(recordings.begin(), recordings.end());
  if (!recordings.empty()) {
    return fmt::format(
        "a folder with {} recordings, {}: give one of them; docs/many-recordings.md "
        "maps all",
        recordings.size(), fmt::join(recordings, ", "));
  }
  if (fs::is_empty(folder)) return "an empty folder: expected a recording";
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    if (const RecordingFormat* const format = detectFormat(file)) {
      return fmt::format("a folder: give its files themselves ({} is {})", name,
                         format->description);
    }
  }
  for (const fs::path& file : files) {
    const auto unread = unreadFile(file);
    if (unread) return fmt::format("a folder; {} in it is {}", file.filename().string(), *unread);
  }
  return std::nullopt;
}

bool isNameCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == ':' || c == '<' || c == '>' || c == ',';
}

/// Returns whether these are the first bytes of an object: the length of its class's name, the
/// name, the content. The length is a byte with the top bit set, or (before MRPT 0.5.5) four bytes,
/// the lowest first. A truncated file may have fewer bytes.
bool beginsAnObject(std::string_view bytes) {
  constexpr std::size_t kShortestName = 3;
  constexpr std::size_t kLongestName = 120;
  constexpr unsigned kTopBit = 0x80;
  const unsigned first = static_cast<unsigned char>(bytes.front());
  const bool short_form = (first & kTopBit) != 0;
  const std::size_t length = first & ~kTopBit;
  if (length < kShortestName || length > kLongestName) return false;
  bytes.remove_prefix(1);
  if (!short_form) {
    const std::string_view zeros = bytes.substr(0, 3);
    if (!std::all_of(zeros.begin(), zeros.end(), [](char c) { return c == '\0'; })) return false;
    bytes.remove_prefix(zeros.size());
  }
  const std::string_view name = bytes.substr(0, length);
  return std::all_of(name.begin(), name.end(), isNameCharacter);
}

void rejectUnread(const fs::path& file) {
  if (isCompressed(file) || fs::is_directory(file)) return;
  if (const auto unread = unreadFormat(file)) {
    throw std::runtime_error(file.string() + ": " + *unread);
  }
}

RecordingParts posesOfRecording(const fs::path& file, ReaderOptions options) {
  const RecordingFormat* const format = detectFormat(file);
  if (format == nullptr) {
    rejectUnread(file);
    throw std::runtime_error(file.string() +
                             ": not a file of poses: expected text (t tx ty tz qx qy qz qw, or "
                             "columns with a header), or a recording with poses");
  }
  options.topics_of_other_files = true;  // the topics are for the events, too
  RecordingParts parts = format->open({file}, options);
  if (!parts.poses_damage.empty()) throw std::runtime_error(parts.poses_damage);
  takeOneTrajectory(parts.poses, file.string(), parts.warnings);
  if (!parts.poses.empty()) return parts;
  throw std::runtime_error(
      fmt::format("{}: no poses: expected {}", file.string(), parts.expected_poses));
}

RecordingParts readAnyPoses(const fs::path& file, const ReaderOptions& options) {
  std::error_code ignored;
  RecordingParts parts;
  if (fs::is_directory(file, ignored)) return posesOfRecording(file, options);
  if (looksLikeNumpy(file)) {
    throw std::runtime_error(fmt::format(
        "{}: {}: expected poses as text. Python writes them: import numpy as np, event_fusion as "
        "ef; z = np.load('{}'); ef.write_poses('poses.txt', (t, T), time_unit='s'), with times t "
        "in their unit and T_world_rig of shape (n, 4, 4), or (n, 7): tx ty tz qx qy qz qw",
        file.string(), arraysIn(file), file.string()));
  }
  const std::string start = firstContentOf(file, 4096);
  requireTextLines(start, file.string());
  if (start.find('\0') != std::string::npos) return posesOfRecording(file, options);
  if (start.compare(0, 8, "#ROSBAG ") == 0) return posesOfRecording(file, options);
  rejectUnread(file);
  if (trimmed(start).substr(0, 1) == "{") {
    parts.poses = readPoseFrames(file, options, parts);
  } else {
    parts.poses = readPoseText(file, options, parts);
  }
  return parts;
}

}  // namespace

std::optional<std::string> unreadFormat(const fs::path& source) {
  try {
    if (const char* const own = ownResult(source)) return fmt::format("{}: {}", own, kOwnResult);
    if (fs::is_directory(source)) return unreadFolder(source);
    return isFile(source) ? unreadFile(source) : std::nullopt;  // a pipe can be read only once
  } catch (const std::exception&) {                             // the folder cannot be listed
    return std::nullopt;
  }
}

bool looksLikeAedat4(const std::filesystem::path& file) { return beginsWith(file, kAedat4Magic); }

#ifndef EFM_WITH_HDF5
RecordingParts openHdf5(const std::vector<std::filesystem::path>& sources, const ReaderOptions&) {
  throw std::runtime_error(sources.front().string() +
                           ": this build does not read HDF5 (EFM_READ_HDF5)");
}
#endif

#ifndef EFM_WITH_AEDAT4
RecordingParts openAedat4(const std::vector<std::filesystem::path>& files, const ReaderOptions&) {
  throw std::runtime_error(files.front().string() +
                           ": this build does not read AEDAT4 (EFM_READ_AEDAT4)");
}
#endif

const std::vector<RecordingFormat>& readerFormats() {
  // A folder of HDF5 files may have a camchain.yaml, too: HDF5 comes before the dataset folder.
  static const std::vector<RecordingFormat> all = {
      {"hdf5", "an HDF5 file, or a folder of them (DSEC, TUM-VIE, VECtor, M3ED, MVSEC, Metavision)",
       looksLikeHdf5, openHdf5, truthOfFolder},
      {"folder", "a dataset folder (camchain.yaml, cam0/events.txt, poses.txt)",
       looksLikeDatasetFolder, openDatasetFolder, truthOfFolder},
      {"uzh", "a folder in the UZH layout (events.txt, groundtruth.txt, calib.txt)",
       looksLikeUzhFolder, openUzhFolder},
      {"rosbag", "a ROS 1 bag (.bag)", looksLikeRosbag, openBags},
      {"rosbag2", "a ROS 2 bag (.mcap, .db3 or the folder with metadata.yaml)", looksLikeRosbag2,
       openBags},
      {"raw", "a RAW or DAT file of a Prophesee camera (EVT 2.0, 2.1 or 3.0)",
       looksLikePropheseeRaw, openPropheseeRaw},
      {"aedat4", "an AEDAT4 file", looksLikeAedat4, openAedat4},
      {"evimo2", "a folder of EVIMO2 (dataset_events_t.npy and others)", looksLikeEvimo2,
       openEvimo2},
      {"numpy", "events in NumPy arrays (.npy)", looksLikeNumpy, openEventArrays},
      {"text", "a text file with a line t x y p per event, also compressed",
       [](const fs::path& file) { return looksLikeEventText(file); }, openEventText},
  };
  return all;
}

std::optional<std::string> whyNoRawlog(const std::filesystem::path& file) {
  constexpr std::size_t kBytes = 128;
  constexpr std::size_t kShown = 24;
  if (!isFile(file)) return "it is no file";
  const std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> stream(gzopen(file.c_str(), "rb"), gzclose_r);
  std::string bytes(kBytes, '\0');
  const int count = stream ? gzread(stream.get(), bytes.data(), kBytes) : -1;
  int code = Z_OK;
  if (stream) gzerror(stream.get(), &code);
  if (count < 0 || code != Z_OK) return std::nullopt;  // damaged: the reader reports it
  bytes.resize(static_cast<std::size_t>(count));
  if (bytes.empty()) return "it is empty";
  if (beginsAnObject(bytes)) return std::nullopt;
  return "it begins with " + inQuotes(bytes.substr(0, kShown));
}

void requireRawlog(const std::filesystem::path& file) {
  std::optional<std::string> why = whyNoRawlog(file);
  if (!why) return;
#ifndef EFM_WITH_ARCHIVES
  if (isCompressed(file)) {
    *why += "; this build does not read other compressed files, EFM_READ_ARCHIVES";
  }
#endif
  throw std::runtime_error(
      file.string() + ": not a rawlog (" + *why +
      "): expected a rawlog, or a recording in another format (docs/recordings.md)");
}

void requireUnits(const ReaderOptions& options) {
  for (const auto& [name, unit] : {std::pair("time_unit", options.time_unit),
                                   std::pair("pose_time_unit", options.pose_time_unit)}) {
    if (unit.empty() || timeExponentOf(unit)) continue;
    throw std::invalid_argument(
        fmt::format("{} = '{}': expected one of s, ms, us, ns", name, unit));
  }
}

const RecordingFormat* detectFormat(const std::filesystem::path& source) {
  for (const RecordingFormat& format : readerFormats()) {
    if (format.matches(source)) return &format;
  }
  return nullptr;
}

RecordingParts readPoseParts(const fs::path& file, const ReaderOptions& options) {
  requireUnits(options);
  RecordingParts parts = readAnyPoses(file, options);
  if (parts.poses.empty())
    throw std::runtime_error(file.string() + ": no poses: expected one or more");
  return parts;
}

std::vector<StampedPose> readPoses(const fs::path& file, const ReaderOptions& options) {
  return readPoseParts(file, options).poses;
}

}  // namespace efm
