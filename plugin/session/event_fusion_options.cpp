// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/event_fusion_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "mapping/base/option.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

void EventFusionOptions::validate() const {
  mapper.validate();
  cloud.validate();
  refinement.refiner.validate();
  live.validate();
  requireOption(min_keyframe_quality >= 0 && min_keyframe_quality <= 1, "min_keyframe_quality",
                min_keyframe_quality, "0 to 1");
}

std::size_t EventFusionOptions::keptKeyframes() const {
  return live.enabled ? static_cast<std::size_t>(live.max_keyframes) : RefinedCloud::kAll;
}

bool isCalibrated(const CameraModel& model) { return model.fx > 0 && model.fy > 0; }

void requireCalibrated(int camera, const CameraModel& model) {
  if (isCalibrated(model)) return;
  throw OptionHint(
      fmt::format(
          "camera {} has no calibration: a map needs --calibration FILE ([rig] calibration)",
          camera),
      {{"rig", "calibration"}});
}

void requireMappable(const Rig& rig, const EventFusionOptions& options) {
  const auto count = static_cast<int>(rig.cameras.size());
  if (count == 0) throw std::invalid_argument("there are no cameras: expected at least one");
  for (int i = 0; i < count; ++i) {
    const RigCamera& camera = rig.cameras[static_cast<std::size_t>(i)];
    requireCalibrated(i, camera.model);
    camera.validate();
  }
  const std::string expected = fmt::format("a camera of the recording: 0 to {}", count - 1);
  for (const int camera : options.mapper.cameras) {
    requireOption(camera < count, OptionName("rig", "cameras"), camera, expected);
  }
  const int reference = options.mapper.keyframe.reference_camera;
  requireOption(reference < count, OptionName("dsi", "reference_camera"), reference, expected);
}

FusionMapperOptions mapperOptions(const EventFusionOptions& options) {
  FusionMapperOptions mapper = options.mapper;
  if (options.late_fusion) mapper.keyframe.camera_maps = true;
  if (options.live.enabled) {
    mapper.fill_last_window = false;
  } else {  // in playback, the cameras may come one after another
    mapper.max_waiting_events =
        static_cast<std::size_t>(options.live.max_queue_mb * 1e6 / sizeof(Event));
  }
  if (!options.automatic.any()) return mapper;
  mapper = surveyOptions(mapper, kFirstWindowS);
  mapper.policy.stride_s = kFirstStrideS;
  return mapper;
}

double LiveOptions::queueEvents() const {
  return std::min(static_cast<double>(max_queue_events), max_queue_mb * 1e6 / sizeof(Event));
}

void limitWindow(double max_s, const std::string& reason, KeyframePolicyOptions& policy,
                 std::vector<ChosenOption>& chosen) {
  constexpr double kMinS = 2e-6;  // with half of it, the stride, as an allowed value
  for (ChosenOption& option : chosen) {
    double* value_s = option.key == "window_s" ? &policy.window_s : nullptr;
    if (option.key == "stride_s") value_s = &policy.stride_s;
    const double limit_s =
        value_s == &policy.stride_s ? policy.window_s / 2 : std::max(max_s, kMinS);
    if (value_s == nullptr || *value_s <= limit_s) continue;
    *value_s = option.value = limit_s;
    option.reason = reason;
  }
  if (policy.policy == KeyframePolicyKind::kBaseline) {
    policy.stride_s = std::min(policy.stride_s, policy.window_s);
  }
}

void fitIntoQueue(const LiveOptions& live, double events_per_s, KeyframePolicyOptions& policy,
                  std::vector<ChosenOption>& chosen) {
  if (!live.enabled || events_per_s <= 0) return;
  limitWindow(live.queueEvents() / 2 / events_per_s,
              "no longer one fits into half of the queue of live operation", policy, chosen);
}

}  // namespace efm
