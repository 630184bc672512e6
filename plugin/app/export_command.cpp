// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/app/commands.h"
#include "plugin/app/interruption.h"
#include "plugin/app/output_checks.h"
#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/writers/recording_writer.h"
#include "plugin/session/health_checks.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

/// An existing file is replaced only if it is a rawlog, and none of the inputs.
void refuseToDestroy(const ImportArguments& arguments) {
  if (std::filesystem::is_regular_file(arguments.out)) requireRawlog(arguments.out);
}

}  // namespace

int runImport(const ImportArguments& arguments) {
  refuseToReplace(arguments.out, inputsOf(arguments.source));
  refuseToDestroy(arguments);
  RecordingSource source = arguments.source;
  source.complete = false;
  source.rounded = false;  // the writer rounds
  source.reader.keep_originals = true;
  source.limits = RecordingTimes(source).resolve(arguments.times);
  const std::unique_ptr<Recording> recording = openRecording(source);
  const Interruption interruption;
  const auto writer = mrptLibrary(arguments.out.string() + ": a rawlog")
                          .writeRawlog(arguments.out, arguments.compression);
  std::map<std::string, std::uint64_t> events;  // per label
  std::uint64_t all_events = 0;
  std::uint64_t poses = 0;
  std::uint64_t odometry = 0;  // of them
  std::uint64_t others = 0;
  std::map<int, CameraModel> cameras;
  std::optional<std::string> damage;
  {
    Progress progress("importing", arguments.verbosity);
    damage = readAll(*recording, [&](Sample sample) {
      interruption.check();
      if (const auto* packet = std::get_if<EventPacket>(&sample)) {
        cameras.emplace(packet->camera, packet->calibration.model);
        events[packet->label] += packet->events.size();
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
    if (all_events == 0) refuseLimitsWithoutEvents(source.limits, *recording);
    if (all_events + poses + others == 0) {
      throw std::runtime_error("the recording holds nothing " + limitsText(source.limits));
    }
    writer->close();
  }
  printWarnings(missingParts(cameras, all_events > 0, poses > 0));
  warnOfLosses(recording->counts());
  if (odometry > 0 && !arguments.source.hand_eye.empty()) {
    printWarnings({{"hand-eye-left-out",
                    fmt::format("odometry ({} observations) cannot hold the hand-eye transform: "
                                "give it to map as well (--hand-eye)",
                                odometry)}});
  }
  const int status = damage ? failAfter(*damage, all_events, poses, arguments.out) : 0;
  if (arguments.verbosity == Verbosity::kQuiet) return status;
  for (const auto& [label, count] : events) fmt::print("{}: {} events\n", label, count);
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
#ifdef EFM_WITH_HDF5
      {"dsec", openHdf5Writer},
#endif
  };
  return all;
}

/// Writes samples, and counts them.
class Export {
 public:
  /// @param rig of the recording; the results' rig has camera 0's frame.
  Export(const ExportArguments& arguments, Rig rig)
      : T_rig_cam0_(rig.cameras[0].T_rig_cam), quiet_(arguments.verbosity == Verbosity::kQuiet) {
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      cameras_.emplace(static_cast<int>(i), rig.cameras[i].model);
    }
    const Rigid3 T_cam0_rig = T_rig_cam0_.inverse();
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      Rigid3& T = rig.cameras[i].T_rig_cam;
      T = i == 0 ? Rigid3() : T_cam0_rig * T;
    }
    for (const ExportFormat& format : formats()) {
      if (format.name == arguments.format) writer_ = format.open(arguments.out, rig);
    }
    if (!writer_) throw std::runtime_error("'" + arguments.format + "' is not a known format");
  }

  void add(Sample sample) {
    if (auto* packet = std::get_if<EventPacket>(&sample)) {
      for (Event& event : packet->events) event.t_ns += packet->calibration.time_offset_ns;
      writer_->addEvents(static_cast<std::size_t>(packet->camera), packet->events);
      events_ += packet->events.size();
    } else if (const auto* pose = std::get_if<PoseSample>(&sample)) {
      if (!pose_source_) pose_source_ = pose->source;
      if (!(pose->source == *pose_source_)) {
        ++other_poses_;
        return;
      }
      writer_->addPose({pose->t_ns, rigPose(*pose, {}) * T_rig_cam0_});
      ++poses_;
    }
  }

  std::uint64_t events() const { return events_; }

  void add(const TruthDepth& truth) { writer_->addTruth(truth.t_ns, truth.file); }

  /// @param damage the error that ended the recording. @return the process's exit status.
  int close(const std::filesystem::path& out, const std::optional<std::string>& damage) {
    if (events_ == 0 && damage) throw std::runtime_error(*damage);
    writer_->close();
    if (!quiet_) fmt::print("{} events, {} poses; written to {}\n", events_, poses_, out.string());
    printWarnings(missingParts(cameras_, events_ > 0, poses_ > 0));
    if (other_poses_ > 0) {
      printWarnings({{"unused-poses", fmt::format("{} poses of other sources than {} were left out",
                                                  other_poses_, asText(*pose_source_))}});
    }
    return damage ? failAfter(*damage, events_, poses_, out) : 0;
  }

 private:
  Rigid3 T_rig_cam0_;
  bool quiet_;
  std::map<int, CameraModel> cameras_;
  std::unique_ptr<RecordingWriter> writer_;
  std::optional<PoseSourceId> pose_source_;
  std::uint64_t events_ = 0;
  std::uint64_t poses_ = 0;
  std::uint64_t other_poses_ = 0;
};

/// An empty folder may be there: a writer of folders fills it.
void refuseExisting(const std::filesystem::path& out) {
  if (!std::filesystem::is_regular_file(out)) return;
  throw std::runtime_error(out.string() + ": it exists: expected the name of a new file or folder");
}

}  // namespace

std::vector<std::string> exportFormats() {
  std::vector<std::string> names;
  for (const ExportFormat& format : formats()) names.push_back(format.name);
  return names;
}

int runExport(const ExportArguments& arguments) {
  refuseToReplace(arguments.out, inputsOf(arguments.source));
  refuseExisting(arguments.out);
  RecordingSource source = arguments.source;
  source.complete = false;
  source.limits = RecordingTimes(source).resolve(arguments.times);
  const std::unique_ptr<Recording> recording = openRecording(source);
  Rig rig = recording->rig();
  if (rig.cameras.empty()) throw std::runtime_error("the recording has no events");
  for (RigCamera& camera : rig.cameras) camera.time_offset_ns = 0;  // added to the stamps
  const Interruption interruption;
  Export result(arguments, rig);
  std::optional<std::string> damage;
  {
    Progress progress("exporting", arguments.verbosity);
    damage = readAll(*recording, [&](Sample sample) {
      interruption.check();
      result.add(std::move(sample));
      progress.show(recording->progress());
    });
  }
  if (!damage && result.events() == 0) refuseLimitsWithoutEvents(source.limits, *recording);
  for (const TruthDepth& truth : openTruth(source)) {
    interruption.check();
    if (source.limits.contain(truth.t_ns)) result.add(truth);
  }
  warnOfLosses(recording->counts());
  return result.close(arguments.out, damage);
}

}  // namespace efm
