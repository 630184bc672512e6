// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/event_fusion_options.h"

#include <algorithm>

#include "maps/cloud/keyframe_cloud.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

RigSetup readRigSetup(const RigOptions& options) {
  return options.setup ? *options.setup : readRigSetup(options.calibration, options.hand_eye);
}

void EventFusionOptions::validate() const {
  mapper.validate();
  cloud.validate();
  refinement.refiner.validate();
  live.validate();
  requireOption(min_keyframe_quality >= 0 && min_keyframe_quality <= 1, "min_keyframe_quality",
                min_keyframe_quality, "0 to 1");
}

std::size_t EventFusionOptions::movableKeyframes() const {
  if (!refinement.enabled) return 0;
  return live.enabled ? static_cast<std::size_t>(live.max_keyframes) : RefinedCloud::kAll;
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
  for (ChosenOption& option : chosen) {
    double* value_s = option.key == "window_s" ? &policy.window_s : nullptr;
    if (option.key == "stride_s") value_s = &policy.stride_s;
    const double limit_s = value_s == &policy.stride_s ? policy.window_s / 2 : max_s;
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
