// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/open_recording.h"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "plugin/formats/dataset_folder.h"
#include "plugin/formats/rawlog_recording.h"
#include "plugin/formats/rawlog_signature.h"
#include "plugin/formats/uzh_text.h"
#include "plugin/recordings/perturbed_recording.h"
#include "plugin/recordings/recording_with_poses.h"
#include "plugin/recordings/rig_override_recording.h"
#include "plugin/session/rig_setup.h"
#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {
namespace {

using Path = std::filesystem::path;

/// A format of recordings. A new format is a row of the table below.
struct Format {
  std::string name;
  bool (*looks_like)(const Path&);
  std::unique_ptr<Recording> (*open)(const Path&, const RecordingOverrides&);
  std::string description;  ///< For errors.
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {"rawlog", [](const Path& source) { return std::filesystem::is_regular_file(source); },
       [](const Path& source, const RecordingOverrides&) -> std::unique_ptr<Recording> {
         requireRawlog(source);
         return std::make_unique<RawlogRecording>(source);
       },
       "a rawlog file"},
      {"folder", looksLikeDatasetFolder, openDatasetFolder,
       "a dataset folder (camchain.yaml, cam0/events.txt, poses.txt)"},
      {"uzh", looksLikeUzhFolder, openUzhFolder,
       "a folder in the UZH layout (events.txt, groundtruth.txt, calib.txt)"},
  };
  return all;
}

std::unique_ptr<Recording> openAs(const std::string& format, const Path& path,
                                  const RecordingOverrides& given) {
  std::string expected;
  for (const Format& known : formats()) {
    if (format == known.name || (format == "auto" && known.looks_like(path))) {
      return known.open(path, given);
    }
    expected += (expected.empty() ? "" : ", ") + known.description;
  }
  if (format != "auto") throw std::runtime_error("'" + format + "' is not a known format");
  throw std::runtime_error(path.string() + ": not a recording; expected " + expected);
}

}  // namespace

std::vector<std::string> recordingFormats() {
  std::vector<std::string> names = {"auto"};
  for (const Format& format : formats()) names.push_back(format.name);
  return names;
}

std::unique_ptr<Recording> openRecording(const RecordingSource& source) {
  if (source.files.size() != 1) {
    throw std::runtime_error(fmt::format("{} sources: expected one", source.files.size()));
  }
  const Path& path = source.files.front();
  if (!std::filesystem::exists(path)) {
    throw std::runtime_error(path.string() + ": no such file or folder");
  }
  const RigSetup setup = readRigSetup({source.calibration, source.hand_eye, {}, {}});
  std::vector<StampedPose> poses;
  if (!source.poses.empty()) poses = readPosesFile(source.poses);

  const RecordingOverrides given = {setup.calibration ? &*setup.calibration : nullptr,
                                    !poses.empty()};
  std::unique_ptr<Recording> recording = openAs(source.format, path, given);
  if (given.has_poses) {
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

}  // namespace efm
