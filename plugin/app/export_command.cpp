// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "event_fusion/engine.h"
#include "plugin/app/commands.h"
#include "plugin/app/interruption.h"
#include "plugin/app/program.h"
#include "plugin/app/recording_interval.h"
#include "plugin/checks/health_checks.h"
#include "plugin/playback/output_checks.h"
#include "plugin/playback/progress.h"
#include "plugin/playback/recording_info.h"
#include "plugin/playback/session_export.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/writers/recording_writer.h"
#include "plugin/session/session_status.h"
#include "plugin/session_file/keyframe_record.h"

namespace efm {
int runImport(const ImportArguments& arguments) {
  rejectReplacing(arguments.out, inputsOf(arguments.source));
  if (std::filesystem::is_regular_file(arguments.out)) requireRawlog(arguments.out);
  RecordingSource source = arguments.source;
  source.complete = false;
  source.reader.keep_originals = true;
  source.limits = RecordingTimes(source).resolve(arguments.times);
  const std::unique_ptr<Recording> recording = openRecording(source);
  const Interruption interruption;
  const auto writer = mrptLibrary(arguments.out.string() + ": a rawlog")
                          .writeRawlog(arguments.out, arguments.compression, *recording);
  std::vector<std::uint64_t> events(recording->rig().cameras.size());
  std::uint64_t all_events = 0;
  std::uint64_t poses = 0;
  std::uint64_t odometry = 0;  // poses from odometry
  std::uint64_t others = 0;
  std::optional<std::string> damage;
  {
    Progress progress("importing", arguments.verbosity);
    damage = readAll(*recording, [&](Sample sample) {
      interruption.check();
      if (const auto* packet = std::get_if<EventPacket>(&sample)) {
        events[static_cast<std::size_t>(packet->camera)] += packet->events.size();
        all_events += packet->events.size();
      } else if (const auto* pose = std::get_if<PoseSample>(&sample)) {
        ++poses;
        if (pose->source.kind == PoseKind::kOdometry) ++odometry;
      } else {
        ++others;
      }
      writer->write(std::move(sample));
      progress.show(recording->progress());
    });
    if (all_events == 0 && damage) throw std::runtime_error(*damage);
    if (all_events == 0) rejectLimitsWithoutEvents(source.limits, *recording);
    if (all_events + poses + others == 0) {
      throw std::runtime_error("the recording holds nothing " + limitsText(source.limits));
    }
    writer->close();
  }
  printWarnings(missingParts(recording->rig(), all_events > 0, poses > 0));
  printWarnings(lossWarnings(recording->counts()));
  printWarnings(recording->counts().notes, "note");
  if (odometry > 0 && !arguments.source.hand_eye.empty()) {
    printWarnings({{"hand-eye-left-out",
                    fmt::format("odometry ({} observations) cannot hold the hand-eye transform: "
                                "give it to map as well (--hand-eye)",
                                odometry)}});
  }
  const int status = damage ? failAfter(*damage, all_events, poses, arguments.out) : 0;
  if (arguments.verbosity == Verbosity::kQuiet) return status;
  const std::vector<RecordedCamera> cameras = recording->cameras();
  for (std::size_t i = 0; i < events.size(); ++i) {
    fmt::print("{}: {} events\n", cameras[i].label, events[i]);
  }
  if (others > 0) fmt::print("{} other observations\n", others);
  fmt::print("{} poses; {} events were out of order and sorted\n", poses,
             recording->counts().sorted_events);
  const auto bytes = static_cast<double>(std::filesystem::file_size(arguments.out));
  fmt::print("written to {}, {:.1f} MB, {:.2f} bytes per event\n", arguments.out.string(),
             bytes * 1e-6, all_events == 0 ? 0.0 : bytes / static_cast<double>(all_events));
  return status;
}

namespace {

struct ExportFormat {
  std::string name;
  std::unique_ptr<RecordingWriter> (*open)(const std::filesystem::path&, const Rig&);
};

const std::vector<ExportFormat>& formats() {
  static const std::vector<ExportFormat> all = {
      {"folder", openFolderWriter},
      {"mcap", openMcapWriter},
  };
  return all;
}

/// Opens the writer. Its rig has camera 0's frame, and no time offsets: the stamps include them.
std::unique_ptr<RecordingWriter> openWriter(const ExportArguments& arguments, Rig rig) {
  const Rigid3 T_cam0_rig = rig.cameras[0].T_rig_cam.inverse();
  for (RigCamera& camera : rig.cameras) {
    camera.T_rig_cam = &camera == &rig.cameras[0] ? Rigid3() : T_cam0_rig * camera.T_rig_cam;
    camera.time_offset_ns = 0;
  }
  const auto format =
      std::find_if(formats().begin(), formats().end(),
                   [&](const ExportFormat& known) { return known.name == arguments.format; });
  return format->open(arguments.out, rig);
}

}  // namespace

std::vector<std::string> exportFormats() {
  std::vector<std::string> names;
  for (const ExportFormat& format : formats()) names.push_back(format.name);
  return names;
}

namespace {

/// Rejects an output that exists.
void requireNew(const ExportArguments& arguments) {
  rejectReplacing(arguments.out, inputsOf(arguments.source));
  if (!std::filesystem::is_regular_file(arguments.out)) return;  // an empty folder is allowed
  throw std::runtime_error(arguments.out.string() +
                           ": it exists: expected the name of a new file or folder");
}

/// Writes the map of sessions.
int exportSessions(const ExportArguments& arguments) {
  const RecordingSource& source = arguments.source;
  requireNew(arguments);
  if (!arguments.format.empty()) {
    throw UsageError("--to " + arguments.format +
                     ": a session's map is exported: the ending of --out decides: " + kMapFiles);
  }
  SessionExport what;
  what.sessions = source.files;
  what.sets = arguments.sets;
  what.limits = RecordingTimes(source).resolve(arguments.times);
  const std::string poses = source.poses.string();
  what.refined = poses != "tracker";
  if (!poses.empty() && poses != "refined" && poses != "tracker") what.poses = source.poses;
  if (arguments.store && what.poses.empty()) {
    throw UsageError("--store: expected --poses FILE, whose poses are stored");
  }
  what.registers = arguments.registers;
  if (what.registers && what.sessions.size() == 1) {
    throw UsageError("--register: expected several sessions");
  }
  if (arguments.transforms.size() >= what.sessions.size()) {
    throw UsageError(
        fmt::format("--transform: given {} times: expected at most once for each "
                    "session after the first ({})",
                    arguments.transforms.size(), what.sessions.size() - 1));
  }
  for (const std::filesystem::path& file : arguments.transforms) {
    what.T_first_this.push_back(readHandEye(file));
  }
  const Interruption interruption;
  std::optional<Progress> progress(std::in_place, "exporting", arguments.verbosity);
  what.on_progress = [&](double fraction) {
    interruption.check();
    progress->show(fraction);
  };
  const SessionMap map = asUsage([&] {
    if (!arguments.box_m.empty()) what.box = Box::of(arguments.box_m);
    requireMapFile(arguments.out, what);
    return SessionMap(what);
  });
  const ExportedMap made = exportSession(map, arguments.out);
  if (arguments.store) map.storePoses();
  progress.reset();
  if (arguments.verbosity == Verbosity::kQuiet) return 0;
  for (std::size_t i = 0; i < map.registrations().size(); ++i) {
    const MapRegistration& found = map.registrations()[i];
    fmt::print(
        "{}: registered, moved {:.2f} cm (sigma {:.2f}) and {:.3f} degrees (sigma {:.3f}); of {} "
        "pairs of keyframes, {} agree\n",
        map.sessions()[i + 1]->path().string(), 100 * found.moved_m, 100 * found.sigma_m,
        found.moved_rad / kRadiansPerDegree, found.sigma_rad / kRadiansPerDegree, found.checked,
        found.pairs);
    const std::vector<double> pose = numbersIn(*map.what().T_first_this[i]);
    fmt::print("  T_first_this: {:.6f} (x y z qx qy qz qw)\n", fmt::join(pose, " "));
  }
  if (!what.poses.empty()) {
    fmt::print("{}: {}\n", what.poses.string(),
               map.posesAreOfKeyframes() ? "T_world_ref of the keyframes"
                                         : "poses of the rig, interpolated");
  }
  fmt::print("{} keyframes, {} points, hash {}; written to {}\n", map.trajectory().size(),
             made.points, made.hash, arguments.out.string());
  return 0;
}

}  // namespace

int runExport(const ExportArguments& arguments) {
  const std::vector<std::filesystem::path>& files = arguments.source.files;
  const auto sessions = std::count_if(files.begin(), files.end(), sessionAt);
  if (sessions == static_cast<std::ptrdiff_t>(files.size())) return exportSessions(arguments);
  if (sessions > 0) throw UsageError("SOURCE: sessions and recordings: expected one of both kinds");
  for (const char* option :
       {arguments.sets.empty() ? "" : "--set", arguments.box_m.empty() ? "" : "--box",
        arguments.transforms.empty() ? "" : "--transform", arguments.store ? "--store" : "",
        arguments.registers ? "--register" : ""}) {
    if (*option != '\0') {
      throw UsageError(std::string(option) + ": is for sessions (session.mcap of a map)");
    }
  }
  if (arguments.format.empty()) {
    throw UsageError(isMapFile(arguments.out)
                         ? files.front().string() +
                               ": no session of a map: expected a session.mcap or its folder"
                         : "--to is required; see event-fusion export --help");
  }
  requireNew(arguments);
  RecordingSource source = arguments.source;
  source.complete = false;
  source.limits = RecordingTimes(source).resolve(arguments.times);
  const std::unique_ptr<Recording> recording = openRecording(source);
  const Rig rig = recording->rig();
  if (rig.cameras.empty()) throw std::runtime_error("the recording has no events");
  const Interruption interruption;
  const std::unique_ptr<RecordingWriter> writer = openWriter(arguments, rig);
  std::uint64_t events = 0;
  std::uint64_t poses = 0;
  std::uint64_t other_poses = 0;
  std::optional<PoseSourceId> pose_source;
  std::optional<std::string> damage;
  {
    Progress progress("exporting", arguments.verbosity);
    damage = readAll(*recording, [&](Sample sample) {
      interruption.check();
      if (auto* packet = std::get_if<EventPacket>(&sample)) {
        const auto camera = static_cast<std::size_t>(packet->camera);
        std::vector<Event> stamped = std::move(packet->events).take();
        for (Event& event : stamped) event.t_ns += rig.cameras[camera].time_offset_ns;
        writer->addEvents(camera, stamped);
        events += stamped.size();
      } else if (const auto* pose = std::get_if<PoseSample>(&sample)) {
        if (!pose_source) pose_source = pose->source;
        const bool is_used = pose->source == *pose_source;
        if (is_used) writer->addPose({pose->t_ns, pose->T_world_rig() * rig.cameras[0].T_rig_cam});
        ++(is_used ? poses : other_poses);
      }
      progress.show(recording->progress());
    });
  }
  if (!damage && events == 0) rejectLimitsWithoutEvents(source.limits, *recording);
  for (const TimedFile& truth : openTruth(source)) {
    interruption.check();
    if (source.limits.contain(truth.t_ns)) writer->addTruth(truth.t_ns, truth.file);
  }
  printWarnings(lossWarnings(recording->counts()));
  printWarnings(recording->counts().notes, "note");
  if (events == 0 && damage) throw std::runtime_error(*damage);
  writer->close();
  if (arguments.verbosity != Verbosity::kQuiet) {
    fmt::print("{} events, {} poses; written to {}\n", events, poses, arguments.out.string());
  }
  printWarnings(missingParts(rig, events > 0, poses > 0));
  if (other_poses > 0) {
    printWarnings({{"unused-poses", fmt::format("{} poses of other sources than {} were left out",
                                                other_poses, asText(*pose_source))}});
  }
  return damage ? failAfter(*damage, events, poses, arguments.out) : 0;
}

}  // namespace efm
