// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/open_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/open/perturbed_recording.h"
#include "plugin/recordings/open/rawlog.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/text/event_columns.h"
#include "plugin/recordings/text/event_text.h"
#include "plugin/recordings/text/pose_text.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {
namespace {

using Path = std::filesystem::path;

constexpr const char* kRawlog = "rawlog";

const RecordingFormat* formatNamed(const std::string& name) {
  for (const RecordingFormat& format : readerFormats()) {
    if (format.name == name) return &format;
  }
  throw std::runtime_error("'" + name + "' is not a known format");
}

[[noreturn]] void refuseUnknown(const Path& path) {
  std::string expected = "a rawlog file";
  for (const RecordingFormat& format : readerFormats()) expected += ", " + format.description;
  throw std::runtime_error(path.string() + ": not a recording; expected " + expected);
}

/// The format of a source; null for a rawlog, and for a file of no format.
const RecordingFormat* formatOf(const Path& path, const RecordingSource& source) {
  const std::string& name = source.format;
  if (!std::filesystem::exists(path)) {
    throw std::runtime_error(path.string() + ": no such file or folder");
  }
  requireNoPipe(path);
  if (name == kRawlog) return nullptr;
  if (name != "auto") return formatNamed(name);
  const RecordingFormat* format = detectFormat(path);
  if (format != nullptr) return format;
  if (looksLikeEventText(path, source.reader)) return formatNamed("text");
  if (const auto unread = unreadFormat(path)) {
    throw std::runtime_error(fmt::format("{}: {} (docs/recordings.md)", path.string(), *unread));
  }
  if (!isFile(path)) refuseUnknown(path);
  return nullptr;
}

std::string sourceNames(const std::vector<Path>& sources) {
  std::string names;
  for (const Path& source : sources) names += (names.empty() ? "" : ", ") + source.string();
  return names;
}

/// Adds the parts of further files.
void append(RecordingParts parts, const Path& source, RecordingParts& all) {
  std::move(parts.cameras.begin(), parts.cameras.end(), std::back_inserter(all.cameras));
  std::move(parts.poses.begin(), parts.poses.end(), std::back_inserter(all.poses));
  if (parts.calibration && all.calibration) {
    throw std::runtime_error(fmt::format(
        "{}: a second calibration, beside {}: expected one of all cameras, or --calibration FILE",
        source.string(), all.calibration->file.string()));
  }
  if (parts.calibration) all.calibration = std::move(parts.calibration);
  if (all.poses_damage.empty()) all.poses_damage = std::move(parts.poses_damage);
  if (!all.default_size) all.default_size = parts.default_size;
}

template <typename Read>
bool reads(const Read& read) {
  try {
    read();
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

/// Whether it is a file that readCalibration reads.
bool isCalibration(const Path& path) {
  constexpr std::uintmax_t kMaxBytes = 100'000;
  std::error_code error;
  return isFile(path) && std::filesystem::file_size(path, error) <= kMaxBytes && !error &&
         reads([&] { readCalibration(path); });
}

/// Whether it is a text of poses, also a compressed one.
bool isPoses(const Path& path) {
  bool poses = false;
  return reads([&] { poses = isFile(path) && looksLikePoseLines(beginningOfText(path)); }) && poses;
}

/// Says what a file is that is no recording, or what the reader that fits best does not accept.
[[noreturn]] void refuse(const Path& path) {
  const std::string name = path.string();
  if (path.extension() == ".ini" && !isCalibration(path)) {
    throw std::runtime_error(name +
                             ": an .ini file among the sources: expected one option file, --config "
                             "NAME; a calibration is given with --calibration");
  }
  if (isPoses(path)) throw std::runtime_error(name + ": poses: expected --poses " + name);
  if (isCalibration(path)) {
    throw std::runtime_error(name + ": a calibration: expected --calibration " + name);
  }
  const std::optional<std::string> why = whyNoRawlog(path);
  if (!why) throw std::runtime_error(name + ": a rawlog beside other sources: expected it alone");
  if (const auto line = whyNoEventLines(beginningOfText(path))) {
    throw std::runtime_error(name + ":" + *line);
  }
  throw std::runtime_error(
      fmt::format("{}: not a recording ({}): expected a rawlog, or a recording in another format "
                  "(docs/recordings.md)",
                  name, *why));
}

/// Whether the user calls a file of no other format a rawlog, or it is one.
bool isRawlog(const Path& path, const RecordingSource& source) {
  return source.format == kRawlog ||
         path.filename().string().find(".rawlog") != std::string::npos || !whyNoRawlog(path);
}

/// The only file of a folder that has a part of the recording which its format did not find. Others
/// are named in what is expected.
/// @param has whether a file has it.
/// @param option that gives another one.
template <typename Has>
std::optional<Path> onlyFileOf(const Path& folder, const Has& has, const char* option,
                               RecordingParts& parts, std::string& expected) {
  std::vector<Path> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (has(entry.path())) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  if (found.size() == 1) {
    parts.warnings.push_back(
        {"found-file", fmt::format("{}: taken, as the only one in the folder ({})",
                                   found.front().string(), option)});
    return found.front();
  }
  for (const Path& path : found) {
    expected += (&path == &found.front() ? " (not clear: " : ", ") + path.filename().string();
  }
  if (!found.empty()) expected += ")";
  return std::nullopt;
}

/// Takes the calibration and the poses that a folder has with other names than its format knows.
void takeFilesOfFolder(const RecordingSource& source, RecordingParts& parts) {
  const Path& folder = source.files.front();
  if (source.files.size() != 1 || !std::filesystem::is_directory(folder)) return;
  if (!parts.calibration && source.calibration.empty()) {
    const auto has = [&](const Path& path) {
      return isCalibration(path) &&
             readCalibration(path).rig.cameras.size() == parts.cameras.size();
    };
    if (const auto file =
            onlyFileOf(folder, has, "--calibration", parts, parts.expected_calibration)) {
      parts.calibration = readCalibration(*file);
    }
  }
  if (parts.poses.empty() && source.poses.empty()) {
    if (const auto file = onlyFileOf(folder, isPoses, "--poses", parts, parts.expected_poses)) {
      parts.poses = readPoses(*file, source.reader);
    }
  }
}

/// Files of the same format are opened together.
RecordingParts openParts(const RecordingSource& source) {
  RecordingParts all;
  for (std::size_t i = 0; i < source.files.size();) {
    const RecordingFormat* const format = formatOf(source.files[i], source);
    if (format == nullptr) refuse(source.files[i]);
    std::vector<Path> files = {source.files[i++]};
    while (i < source.files.size() && formatOf(source.files[i], source) == format) {
      files.push_back(source.files[i++]);
    }
    RecordingParts parts = format->open(files, source.reader);
    if (all.cameras.empty() && all.poses.empty()) {
      std::swap(all, parts);
    } else {
      append(std::move(parts), files.front(), all);
    }
  }
  return all;
}

/// The size of a camera's sensor: of the stream, the recording's own calibration, or the given one.
std::optional<CameraSize> knownSizeOf(const RecordingParts& parts, std::size_t camera,
                                      const Calibration* given) {
  if (const auto size = parts.cameras[camera]->size()) {
    if (const auto known = knownSize(*size)) return known;
  }
  const Calibration* const own = parts.calibration ? &*parts.calibration : nullptr;
  for (const Calibration* const calibration : {own, given}) {
    if (calibration == nullptr || camera >= calibration->rig.cameras.size()) continue;
    const CameraModel& model = calibration->rig.cameras[camera].model;
    if (model.width > 0) return CameraSize{model.width, model.height};
  }
  return std::nullopt;
}

/// The same, or that of the option, or the format's usual one.
/// @throws std::runtime_error where the option has another size than is known.
std::optional<CameraSize> sizeOf(const RecordingParts& parts, std::size_t camera,
                                 const Calibration* given, const RecordingSource& source) {
  const std::optional<CameraSize> known = knownSizeOf(parts, camera, given);
  const std::optional<CameraSize>& told = source.reader.sensor_size;
  if (!known) return told ? told : parts.default_size;
  if (told && (told->width != known->width || told->height != known->height)) {
    throw std::runtime_error(fmt::format("--sensor-size {}x{}: {} has {}x{} pixels", told->width,
                                         told->height, parts.cameras[camera]->name(), known->width,
                                         known->height));
  }
  return known;
}

/// The recording's own rig if it has one. Then the caller replaces it by a given one and counts the
/// difference.
Rig rigOf(const RecordingParts& parts, const RecordingSource& source, const Calibration* given) {
  const std::size_t count = parts.cameras.size();
  const Calibration* const own = parts.calibration ? &*parts.calibration : nullptr;
  const Calibration* const calibration = own != nullptr ? own : given;
  if (calibration == nullptr && source.complete) {
    throw std::runtime_error(fmt::format("{}: no calibration: expected {}, or --calibration FILE",
                                         sourceNames(source.files), parts.expected_calibration));
  }
  Rig rig;
  for (std::size_t camera = 0; camera < count; ++camera) {
    const std::optional<CameraSize> size = sizeOf(parts, camera, given, source);
    if (calibration != nullptr) {
      rig.cameras.push_back(calibration->camera(camera, size));
    } else {
      RigCamera& unknown = rig.cameras.emplace_back();
      unknown.model.width = size.value_or(kUnknownSize).width;
      unknown.model.height = size.value_or(kUnknownSize).height;
    }
  }
  if (given != nullptr) given->requireLike(rig);
  return rig;
}

/// The least and the greatest time offset that a camera may have: none, the recording's own, the
/// given one.
std::pair<std::int64_t, std::int64_t> offsetsOf(const Rig& rig, std::size_t camera,
                                                const Calibration* given) {
  const std::int64_t own_ns = rig.cameras[camera].time_offset_ns;
  const std::int64_t given_ns = given == nullptr ? 0 : given->rig.cameras[camera].time_offset_ns;
  return std::minmax({std::int64_t{0}, own_ns, given_ns});
}

std::unique_ptr<Recording> join(RecordingParts parts, const RecordingSource& source,
                                const Calibration* given) {
  if (parts.cameras.empty() && source.complete) {
    throw std::runtime_error(sourceNames(source.files) + ": no events: expected some");
  }
  Rig rig = parts.cameras.empty() ? Rig() : rigOf(parts, source, given);
  std::vector<EventPackets> cameras;
  for (std::size_t i = 0; i < parts.cameras.size(); ++i) {
    const CameraModel& model = rig.cameras[i].model;
    cameras.emplace_back(std::move(parts.cameras[i]), CameraSize{model.width, model.height},
                         source.packet_ns);
    const auto [earliest_ns, latest_ns] = offsetsOf(rig, i, given);
    if (source.start_ns) cameras.back().startAt(*source.start_ns - latest_ns);
    if (source.end_ns) cameras.back().stopAt(*source.end_ns - earliest_ns);
  }
  const bool has_limits = source.start_ns || source.end_ns;
  auto events =
      std::make_unique<MergedRecording>(std::move(rig), std::move(cameras), source.skip_bad_events);
  if (!has_limits) events->requireEvents();
  events->addWarnings(std::move(parts.warnings));
  std::unique_ptr<Recording> recording = std::move(events);
  if (!source.poses.empty()) return recording;
  if (parts.poses.empty() && source.complete) {
    throw std::runtime_error(fmt::format("{}: no poses: expected {}, or --poses FILE",
                                         sourceNames(source.files), parts.expected_poses));
  }
  return std::make_unique<RecordingWithPoses>(std::move(recording), std::move(parts.poses),
                                              std::move(parts.poses_damage));
}

std::unique_ptr<Recording> openOwn(const RecordingSource& source, const Calibration* given) {
  if (source.files.empty()) throw std::runtime_error("no source: expected a recording");
  const Path& first = source.files.front();
  if (formatOf(first, source) == nullptr && source.files.size() == 1) {
    if (!isRawlog(first, source)) refuse(first);
    requireRawlog(first);
    if (source.reader.sensor_size) {
      throw std::runtime_error(
          first.string() +
          ": a rawlog, which has the size of its cameras: --sensor-size has no "
          "use");
    }
    return std::make_unique<RawlogRecording>(first);
  }
  RecordingParts parts = openParts(source);
  takeFilesOfFolder(source, parts);
  return join(std::move(parts), source, given);
}

/// @param given how the user gave the file; empty: as the value of `option`.
void requireGivenFile(const Path& file, const char* option, const std::string& given) {
  if (std::filesystem::exists(file)) return requireNoPipe(file);
  if (file.empty()) return;
  throw std::runtime_error(
      fmt::format("{}: no such file", given.empty() ? option + (" " + file.string()) : given));
}

}  // namespace

std::vector<std::string> recordingFormats() {
  std::vector<std::string> names = {"auto", kRawlog};
  for (const RecordingFormat& format : readerFormats()) names.push_back(format.name);
  return names;
}

std::unique_ptr<Recording> openRecording(const RecordingSource& source) {
  requireGivenFile(source.poses, "--poses", {});
  requireGivenFile(source.calibration, "--calibration", source.calibration_given);
  requireGivenFile(source.hand_eye, "--hand-eye", source.hand_eye_given);
  const RigSetup setup = readRigSetup({source.calibration, source.hand_eye, {}, {}});
  std::vector<StampedPose> poses;
  if (!source.poses.empty()) poses = readPoses(source.poses, source.reader);

  std::unique_ptr<Recording> recording =
      openOwn(source, setup.calibration ? &*setup.calibration : nullptr);
  if (!source.poses.empty()) {
    recording = std::make_unique<RecordingWithPoses>(std::move(recording), std::move(poses));
  }
  if (source.faults.any()) {
    recording = std::make_unique<PerturbedRecording>(std::move(recording), source.faults);
  }
  if (source.override_rig && (setup.calibration || setup.T_body_rig)) {
    recording = std::make_unique<RigOverrideRecording>(std::move(recording), setup);
  }
  return recording;
}

std::vector<TruthDepth> openTruth(const RecordingSource& source) {
  std::vector<TruthDepth> truth;
  for (const Path& file : source.files) {
    const RecordingFormat* const format = formatOf(file, source);
    if (format == nullptr || format->truth == nullptr) continue;
    const std::vector<TruthDepth> found = format->truth(file);
    truth.insert(truth.end(), found.begin(), found.end());
  }
  return truth;
}

}  // namespace efm
