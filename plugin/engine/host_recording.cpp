// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "event_fusion/engine.h"
#include "plugin/engine/host_text.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {
namespace {

/// The recording of a program, whose errors name Overrides.
class HostRecording : public Recording {
 public:
  explicit HostRecording(std::unique_ptr<Recording> of) : of_(std::move(of)) {}
  std::optional<Sample> read() override { return of_->read(); }
  std::string damage() const override { return hostText(of_->damage(), HostFace::kRecording); }
  const Rig& rig() const override { return of_->rig(); }
  std::vector<RecordedCamera> cameras() const override { return of_->cameras(); }
  std::string position() const override { return of_->position(); }
  double progress() const override { return of_->progress(); }
  RecordingCounts counts() const override {
    RecordingCounts counts = of_->counts();
    counts.warnings = hostTexts(std::move(counts.warnings), HostFace::kRecording);
    counts.notes = hostTexts(std::move(counts.notes), HostFace::kRecording);
    return counts;
  }

 private:
  std::unique_ptr<Recording> of_;
};

}  // namespace

std::unique_ptr<Recording> openRecording(const std::vector<std::filesystem::path>& files,
                                         const Overrides& overrides) {
  return forHost(HostFace::kRecording, [&] {
    return std::make_unique<HostRecording>(openRecording(sourceOf(files, overrides)));
  });
}

RecordingSource sourceOf(const std::vector<std::filesystem::path>& files,
                         const Overrides& overrides) {
  overrides.limits.validate();
  RecordingSource source;
  source.files = files;
  source.poses = overrides.poses;
  source.calibration = overrides.calibration;
  source.hand_eye = overrides.hand_eye;
  source.limits = overrides.limits;
  source.format = overrides.format;
  source.reader.topics = overrides.topics;
  source.reader.columns = overrides.event_columns;
  source.reader.time_unit = overrides.time_unit;
  source.reader.pose_time_unit = overrides.pose_time_unit;
  if (overrides.sensor_size) {
    source.reader.sensor_size = {overrides.sensor_size->first, overrides.sensor_size->second};
  }
  source.skip_bad_events = overrides.skip_bad_events;
  source.cameras = overrides.cameras;
  return source;
}

}  // namespace efm
