// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/open_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/open/joined_recording.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/pose_conflict.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/event_columns.h"
#include "plugin/recordings/text/event_text.h"
#include "plugin/recordings/text/pose_text.h"

namespace efm {
namespace {

using Path = std::filesystem::path;

constexpr const char* kRawlog = "rawlog";

const RecordingFormat* formatNamed(const std::string& name) {
  for (const RecordingFormat& format : readerFormats()) {
    if (format.name == name) return &format;
  }
  throw std::invalid_argument(fmt::format("'{}' is not a known format: expected one of {}", name,
                                          fmt::join(recordingFormats(), ", ")));
}

[[noreturn]] void rejectUnknown(const Path& path) {
  std::string expected = "a rawlog file";
  for (const RecordingFormat& format : readerFormats()) expected += ", " + format.description;
  throw std::runtime_error(path.string() + ": not a recording; expected " + expected);
}

/// Returns whether a file of no other format has the name or the content of a rawlog.
bool isRawlog(const Path& path) {
  return path.filename().string().find(".rawlog") != std::string::npos || !whyNoRawlog(path);
}

RecordingParts openRawlog(const std::vector<Path>& files, const ReaderOptions& options) {
  requireRawlog(files.front());
  return mrptLibrary(files.front().string() + ": a rawlog").openRawlog(files.front(), options);
}

const RecordingFormat& rawlogFormat() {
  static const RecordingFormat format = {kRawlog, "a rawlog", isRawlog, openRawlog};
  return format;
}

bool isBag(const RecordingFormat* format) {
  return format != nullptr && format->name.rfind("rosbag", 0) == 0;
}

/// Returns the format of a source; null for a file of no format.
const RecordingFormat* formatOf(const Path& path, const RecordingSource& source) {
  const std::string& name = source.format;
  if (!std::filesystem::exists(path)) {
    throw std::runtime_error(path.string() + ": no such file or folder");
  }
  requireNoPipe(path);
  if (name == kRawlog) return &rawlogFormat();
  if (name != "auto") return formatNamed(name);
  const RecordingFormat* format = detectFormat(path);
  if (format != nullptr) return format;
  if (looksLikeEventText(path, source.reader)) return formatNamed("text");
  if (const auto unread = unreadFormat(path)) {
    throw std::runtime_error(fmt::format("{}: {} (docs/recordings.md)", path.string(), *unread));
  }
  if (!isFile(path)) rejectUnknown(path);
  return isRawlog(path) ? &rawlogFormat() : nullptr;
}

std::string sourceNames(const std::vector<Path>& sources) {
  std::string names;
  for (const Path& source : sources) names += (names.empty() ? "" : ", ") + source.string();
  return names;
}

template <typename Value>
void moveAll(std::vector<Value>& from, std::vector<Value>& to) {
  std::move(from.begin(), from.end(), std::back_inserter(to));
}

/// Adds the parts of further files.
void append(RecordingParts parts, const Path& source, RecordingParts& all) {
  moveAll(parts.cameras, all.cameras);
  moveAll(parts.poses, all.poses);
  if (parts.calibration && all.calibration) {
    throw std::runtime_error(fmt::format(
        "{}: a second calibration, beside {}: expected one of all cameras, or --calibration FILE",
        source.string(), all.calibration->file.string()));
  }
  if (parts.calibration) all.calibration = std::move(parts.calibration);
  moveAll(parts.warnings, all.warnings);
  moveAll(parts.notes, all.notes);
  moveAll(parts.topics, all.topics);
  moveAll(parts.transforms, all.transforms);
  all.camera_frames.resize(all.cameras.size() - parts.cameras.size());
  moveAll(parts.camera_frames, all.camera_frames);
  if (all.poses_damage.empty()) all.poses_damage = std::move(parts.poses_damage);
  if (!all.default_size) all.default_size = parts.default_size;
  if (all.one_camera.empty()) all.one_camera = std::move(parts.one_camera);
}

/// Returns the calibration in a file; std::nullopt if `readCalibration` does not read the file.
std::optional<Calibration> calibrationIn(const Path& path) {
  constexpr std::uintmax_t kMaxBytes = 100'000;
  std::error_code error;
  if (!isFile(path) || std::filesystem::file_size(path, error) > kMaxBytes || error) return {};
  try {
    return readCalibration(path);
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

/// Returns a file with a text of poses, also a compressed text; std::nullopt for another file.
std::optional<Path> posesIn(const Path& path) {
  try {
    if (isFile(path) && looksLikePoseLines(beginningOfText(path))) return path;
  } catch (const std::exception&) {
  }
  return std::nullopt;
}

/// Throws an error: the kind of a file that is no recording, or the best-fitting reader's problem.
[[noreturn]] void reject(const Path& path) {
  const std::string name = path.string();
  if (path.extension() == ".ini" && !calibrationIn(path)) {
    throw std::runtime_error(name +
                             ": an .ini file among the sources: expected one option file, --config "
                             "NAME; a calibration is given with --calibration");
  }
  if (posesIn(path)) throw std::runtime_error(name + ": poses: expected --poses " + name);
  if (calibrationIn(path)) {
    throw std::runtime_error(name + ": a calibration: expected --calibration " + name);
  }
  const std::string why = whyNoRawlog(path).value_or("it looks like a rawlog");
  if (hasEventTable(beginningOfText(path))) {
    std::vector<Event> events;
    EventTextStream text(path);
    text.read(events);
    throw std::runtime_error(text.damage().empty() ? name + ": there is no event after the header"
                                                   : text.damage());  // of its first line
  }
  throw std::runtime_error(
      fmt::format("{}: not a recording ({}): expected a rawlog, or a recording in another format "
                  "(docs/recordings.md)",
                  name, why));
}

/// Returns a part of the recording that its format did not find: from the only file of the folder
/// that has it. If there are several such files, it adds their names to the text `expected`.
/// @param read function that returns the part in a file, if it has one.
/// @param option option that gives another file.
template <typename Read>
auto onlyPartIn(const Path& folder, const Read& read, const char* option, RecordingParts& parts,
                std::string& expected) {
  std::map<Path, decltype(read(folder))> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (auto part = read(entry.path())) found.emplace(entry.path(), std::move(part));
  }
  if (found.size() == 1) {
    parts.notes.push_back(
        {"found-file", fmt::format("{}: taken, as the only one in the folder ({})",
                                   found.begin()->first.string(), option)});
    return std::move(found.begin()->second);
  }
  const char* before = " (not clear: ";
  for (const auto& [path, part] : found) {
    expected += std::exchange(before, ", ") + path.filename().string();
  }
  if (!found.empty()) expected += ")";
  return decltype(read(folder))();
}

/// Takes calibration and poses of a folder from files whose names its format does not know.
void takeFilesOfFolder(const RecordingSource& source, RecordingParts& parts) {
  const Path& folder = source.files.front();
  if (source.files.size() != 1 || !std::filesystem::is_directory(folder)) return;
  if (!parts.calibration && source.calibration.empty()) {
    const auto fitting = [&](const Path& path) {
      auto calibration = calibrationIn(path);
      if (calibration && calibration->rig.cameras.size() != parts.cameras.size())
        calibration.reset();
      return calibration;
    };
    parts.calibration =
        onlyPartIn(folder, fitting, "--calibration", parts, parts.expected_calibration);
  }
  if (parts.poses.empty() && source.poses.empty()) {
    if (const auto file = onlyPartIn(folder, posesIn, "--poses", parts, parts.expected_poses)) {
      parts.poses = readPoses(*file, source.reader);
    }
  }
}

/// Opens the files. Successive files of the same format are opened together.
RecordingParts openParts(const RecordingSource& source, bool has_hand_eye) {
  RecordingParts all;
  ReaderOptions options = source.reader;
  options.has_hand_eye = has_hand_eye;
  options.leaves_out_poses = !source.poses.empty();
  options.topics_of_other_files = !source.poses.empty() && isBag(detectFormat(source.poses));
  for (std::size_t i = 0; i < source.files.size();) {
    const RecordingFormat* const format = formatOf(source.files[i], source);
    if (format == nullptr) reject(source.files[i]);
    if (format == &rawlogFormat() && source.files.size() > 1) {
      throw std::runtime_error(source.files[i].string() +
                               ": a rawlog beside other sources: expected it alone");
    }
    std::vector<Path> files = {source.files[i++]};
    while (i < source.files.size() && formatOf(source.files[i], source) == format) {
      files.push_back(source.files[i++]);
    }
    RecordingParts parts = format->open(files, options);
    if (all.cameras.empty() && all.poses.empty()) {
      std::swap(all, parts);
    } else {
      if (!source.calibration.empty()) all.calibration.reset();
      append(std::move(parts), files.front(), all);
    }
  }
  return all;
}

/// Adds the poses of the given file.
void addGivenPoses(const RecordingSource& source, bool has_hand_eye, RecordingParts& parts) {
  ReaderOptions options = source.reader;
  options.has_hand_eye = has_hand_eye;
  if (!parts.camera_frames.empty()) {
    options.camera_frame = parts.camera_frames.front().name;
    for (const Path& file : source.files) {
      const RecordingFormat* const format = formatOf(file, source);
      if (isBag(format) && file != source.poses) options.events_files.push_back(file);
    }
  }
  RecordingParts given = readPoseParts(source.poses, options);
  parts.poses = std::move(given.poses);
  parts.pose_samples.clear();
  parts.poses_damage.clear();
  moveAll(given.warnings, parts.warnings);
  moveAll(given.notes, parts.notes);
}

/// Leaves out the poses with wrong times of each source.
/// @throws std::runtime_error for poses of a source that are not one trajectory.
void takeOneTrajectoryEach(RecordingParts& parts, const RecordingSource& source) {
  const std::string name = sourceNames(source.files);
  takeOneTrajectory(parts.poses, name, parts.warnings);
  std::map<PoseSourceId, std::pair<std::vector<StampedPose>, std::vector<std::size_t>>> by_source;
  for (std::size_t i = 0; i < parts.pose_samples.size(); ++i) {
    const PoseSample& pose = parts.pose_samples[i];
    auto& [poses, indices] = by_source[pose.source];
    poses.push_back({pose.t_ns, pose.T_world_rig()});
    indices.push_back(i);
  }
  std::vector<std::size_t> wrong;
  for (auto& [id, of_source] : by_source) {
    auto& [poses, indices] = of_source;
    for (const std::size_t i : takeOneTrajectory(poses, name + ": " + asText(id), parts.warnings)) {
      wrong.push_back(indices[i]);
    }
  }
  std::sort(wrong.begin(), wrong.end());
  removeAt(wrong, parts.pose_samples);
}

/// Compares the cameras' poses on the rig with the transforms of a bag.
void compareFrames(const std::vector<RecordingParts::CameraFrame>& frames, const Rig& rig,
                   std::vector<Warning>& warnings) {
  constexpr double kSameM = 0.01;
  constexpr double kSameRad = kRadiansPerDegree;
  for (std::size_t c = 1; c < std::min(frames.size(), rig.cameras.size()); ++c) {
    if (!frames[c].T_cam0_cam || rig.cameras[c].model.fx == 0) continue;
    const Rigid3 T_cam0_cam = rig.cameras[0].T_rig_cam.inverse() * rig.cameras[c].T_rig_cam;
    const Vector6d change = differenceOf(T_cam0_cam.inverse() * *frames[c].T_cam0_cam);
    const double apart_m = change.head<3>().norm();
    const double apart_rad = change.tail<3>().norm();
    if (apart_m <= kSameM && apart_rad <= kSameRad) continue;
    warnings.push_back(
        {"camera-frame",
         fmt::format("camera {} is {:.3g} m and {:.3g} degrees away from the transform {}->{} of "
                     "the bag: the calibration is of another rig, its cameras are in another "
                     "order, or the transform is wrong (--calibration, --topics)",
                     c, apart_m, apart_rad / kRadiansPerDegree, frames[0].name, frames[c].name)});
  }
}

/// Returns a sensor's size: from the stream, the recording's own or the given calibration.
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

/// Returns `knownSizeOf`, else the size in the option, else the format's usual size.
/// @throws std::runtime_error if the option differs from the known size.
std::optional<CameraSize> sizeOf(const RecordingParts& parts, std::size_t camera,
                                 const Calibration* given, const RecordingSource& source) {
  const std::optional<CameraSize> known = knownSizeOf(parts, camera, given);
  const std::optional<CameraSize>& given_size = source.reader.sensor_size;
  if (!known) return given_size ? given_size : parts.default_size;
  if (given_size && (given_size->width != known->width || given_size->height != known->height)) {
    throw std::runtime_error(fmt::format(
        "--sensor-size {}x{}: {} has {}x{} pixels", given_size->width, given_size->height,
        parts.cameras[camera]->name(), known->width, known->height));
  }
  return known;
}

/// Returns whether calibrations are equal, except for the rounding of MRPT's poses.
bool areNear(const RigCamera& own, const RigCamera& given) {
  constexpr double kRounding = 1e-9;
  const Rigid3 T_own_given = own.T_rig_cam.inverse() * given.T_rig_cam;
  return own.model == given.model && T_own_given.translation.norm() < kRounding &&
         T_own_given.rotation.vec().norm() < kRounding;
}

/// Returns the rig: by the given calibration, else the recording's own, with the given time
/// offsets.
/// @param recalibrated receives whether the given calibration replaces another one.
Rig rigOf(const RecordingParts& parts, const RecordingSource& source, const RigSetup& setup,
          bool& recalibrated) {
  const std::size_t count = parts.cameras.size();
  const Calibration* const given = setup.calibration ? &*setup.calibration : nullptr;
  const Calibration* const own = parts.calibration ? &*parts.calibration : nullptr;
  if (own != nullptr) own->requireCameras(count);
  if (own == nullptr && given == nullptr && source.complete) {
    throw std::runtime_error(fmt::format("{}: no calibration: expected {}, or --calibration FILE",
                                         sourceNames(source.files), parts.expected_calibration));
  }
  Rig recorded;
  for (std::size_t camera = 0; camera < count; ++camera) {
    const std::optional<CameraSize> size = sizeOf(parts, camera, given, source);
    RigCamera& of_rig = recorded.cameras.emplace_back();
    of_rig.model.width = size.value_or(kUnknownSize).width;
    of_rig.model.height = size.value_or(kUnknownSize).height;
    if (own != nullptr) {
      of_rig = own->camera(camera, size);
    } else if (given != nullptr) {
      of_rig = given->camera(camera, size);
    }
  }
  Rig rig = calibrated(recorded, setup, source.time_offsets_ns);
  for (std::size_t camera = 0; camera < count && own != nullptr; ++camera) {
    recalibrated = recalibrated || !areNear(recorded.cameras[camera], rig.cameras[camera]);
  }
  return rig;
}

/// Makes samples of poses without other data.
std::vector<PoseSample> samplesOf(const std::vector<StampedPose>& poses) {
  std::vector<PoseSample> samples;
  samples.reserve(poses.size());
  for (const StampedPose& pose : poses) {
    PoseSample& sample = samples.emplace_back();
    sample.source.label = "pose";
    sample.t_ns = nearestTick(pose.t_ns);
    sample.T_world_body = roundedPose(pose.T_world_rig);
  }
  return samples;
}

/// Applies the faults to the poses of each tracker. An inserted pose is a copy of the next pose,
/// except for its time and T_world_body.
/// @param T_body_rig replaces that of the samples, if set.
std::vector<PoseSample> withFaults(std::vector<PoseSample> samples, TrackerFaults faults,
                                   const std::optional<Rigid3>& T_body_rig, const Rig& rig) {
  faults.perturbation.tick_ns = kTickNs;
  std::stable_sort(samples.begin(), samples.end(),
                   [](const auto& a, const auto& b) { return a.t_ns < b.t_ns; });
  std::map<PoseSourceId, std::vector<PoseSample>> trackers;
  std::vector<PoseSample> all;
  for (PoseSample& sample : samples) {
    auto& to = sample.source.kind == PoseKind::kPose ? trackers[sample.source] : all;
    to.push_back(std::move(sample));
  }
  for (const auto& [source, tracked] : trackers) {
    std::vector<StampedPose> poses;
    for (const PoseSample& sample : tracked) poses.push_back({sample.t_ns, sample.T_world_body});
    faults.process.T_body_cam = T_body_rig.value_or(tracked.front().T_body_rig);
    if (!rig.cameras.empty()) {
      faults.process.T_body_cam = faults.process.T_body_cam * rig.cameras.front().T_rig_cam;
    }
    auto next = tracked.begin();
    for (const StampedPose& pose : efm::withFaults(poses, faults)) {
      while (next->t_ns < pose.t_ns) ++next;  // lost, or used already
      PoseSample& sample = all.emplace_back(*next);
      if (next->t_ns == pose.t_ns) ++next;
      sample.t_ns = pose.t_ns;
      if (!faults.move() || !pose.T_world_rig.translation.allFinite()) continue;
      sample.T_world_body = roundedPose(pose.T_world_rig);
    }
  }
  return all;
}

/// Returns the poses with the faults.
std::vector<PoseSample> posesOf(RecordingParts& parts, const RecordingSource& source,
                                const RigSetup& setup, const Rig& rig) {
  if (parts.poses.empty() && parts.pose_samples.empty() && source.complete) {
    throw std::runtime_error(fmt::format("{}: no poses: expected {}, or --poses FILE",
                                         sourceNames(source.files), parts.expected_poses));
  }
  std::vector<PoseSample> samples = std::move(parts.pose_samples);
  if (samples.empty()) samples = samplesOf(parts.poses);
  if (source.faults.any()) {
    samples = withFaults(std::move(samples), source.faults, setup.T_body_rig, rig);
  }
  if (setup.T_body_rig) {
    for (PoseSample& sample : samples) sample.T_body_rig = *setup.T_body_rig;
  }
  return samples;
}

/// @throws std::runtime_error if a file of several cameras does not fit the calibration.
void requireCameras(const Calibration& given, const RecordingParts& parts) {
  try {
    given.requireCameras(parts.cameras.size());
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{} ({})", error.what(), parts.one_camera));
  }
}

void requireGivenFile(const Path& file, const char* option) {
  if (std::filesystem::exists(file)) return requireNoPipe(file);
  if (file.empty()) return;
  throw std::runtime_error(fmt::format("{} {}: no such file", option, file.string()));
}

}  // namespace

std::vector<std::string> recordingFormats() {
  std::vector<std::string> names = {"auto", kRawlog};
  for (const RecordingFormat& format : readerFormats()) names.push_back(format.name);
  return names;
}

RigSetup readRigSetup(const RecordingSource& source) {
  if (source.setup) return *source.setup;
  requireGivenFile(source.calibration, "--calibration");
  requireGivenFile(source.hand_eye, "--hand-eye");
  return readRigSetup(source.calibration, source.hand_eye);
}

std::unique_ptr<Recording> openRecording(const RecordingSource& source) {
  requireUnits(source.reader);
  requireGivenFile(source.poses, "--poses");
  RigSetup setup = readRigSetup(source);
  if (source.files.empty()) throw std::runtime_error("no source: expected a recording");
  const bool has_hand_eye = setup.T_body_rig.has_value();
  RecordingParts parts = openParts(source, has_hand_eye);
  takeFilesOfFolder(source, parts);
  if (source.poses.empty()) {
    takeOneTrajectoryEach(parts, source);
  } else {
    addGivenPoses(source, has_hand_eye, parts);
  }
  if (parts.cameras.empty() && source.complete) {
    throw std::runtime_error(sourceNames(source.files) + ": no events: expected some");
  }

  JoinedParts joined;
  if (setup.calibration) {
    const std::size_t all = setup.calibration->rig.cameras.size();
    setup.calibration = setup.calibration->of(parts.cameras.size(), source.cameras);
    if (setup.calibration->rig.cameras.size() < all) joined.of_calibration = source.cameras;
  }
  const Calibration* const given = setup.calibration ? &*setup.calibration : nullptr;
  if (given != nullptr && !parts.one_camera.empty()) requireCameras(*given, parts);
  if (given != nullptr && parts.calibration &&
      parts.calibration->rig.cameras.size() != parts.cameras.size()) {
    parts.calibration.reset();
  }
  if (!parts.cameras.empty()) joined.rig = rigOf(parts, source, setup, joined.recalibrated);
  for (std::size_t i = 0; i < parts.cameras.size(); ++i) {
    const CameraModel& model = joined.rig.cameras[i].model;
    joined.cameras.emplace_back(std::move(parts.cameras[i]), CameraSize{model.width, model.height},
                                source.packet_ns);
  }
  compareFrames(parts.camera_frames, given != nullptr ? given->rig : joined.rig, parts.warnings);
  joined.poses = posesOf(parts, source, setup, joined.rig);
  joined.poses_damage = std::move(parts.poses_damage);
  if (!source.complete) joined.others = std::move(parts.others);
  joined.all_poses = source.complete;
  joined.only_poses = source.only_poses;
  joined.latency_ns = source.faults.latency_ns;
  joined.skip_bad_events = source.skip_bad_events;
  joined.warnings = std::move(parts.warnings);
  joined.notes = std::move(parts.notes);
  joined.topics = std::move(parts.topics);
  joined.transforms = std::move(parts.transforms);
  return join(std::move(joined), source.limits);
}

std::vector<TimedFile> openTruth(const RecordingSource& source) {
  std::vector<TimedFile> truth;
  for (const Path& file : source.files) {
    const RecordingFormat* const format = formatOf(file, source);
    if (format == nullptr || format->truth == nullptr) continue;
    const std::vector<TimedFile> found = format->truth(file);
    truth.insert(truth.end(), found.begin(), found.end());
  }
  return truth;
}

}  // namespace efm
