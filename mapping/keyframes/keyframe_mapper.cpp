// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_mapper.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/option_check.h"
#include "mapping/events/even_choice.h"
#include "mapping/events/event_check.h"
#include "mapping/keyframes/corrected_keyframe.h"
#include "mapping/keyframes/view_motion.h"

namespace efm {
namespace {

void requireCamera(const Rig& rig, int camera, const char* key) {
  const auto count = static_cast<int>(rig.cameras.size());
  requireOption(camera >= 0 && camera < count, key, camera,
                "a camera of the recording: 0 to " + std::to_string(count - 1));
}

/// At most `max_events` of each camera; 0: all. @param chosen holds them where there are more.
std::vector<CameraEvents> withinBudget(std::vector<CameraEvents> cameras, std::size_t max_events,
                                       std::vector<std::vector<Event>>& chosen) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    cameras[i].events = chooseEvenly(cameras[i].events, max_events, chosen[i]);
  }
  return cameras;
}

std::uint64_t countOf(const std::vector<CameraEvents>& cameras) {
  std::uint64_t count = 0;
  for (const CameraEvents& camera : cameras) count += camera.events.size();
  return count;
}

double maximumOf(const cv::Mat1f& confidence) {
  double maximum = 0;
  cv::minMaxLoc(confidence, nullptr, &maximum);
  return maximum;
}

}  // namespace

void KeyframeMapperOptions::validate() const {
  planes.validate();
  requireOption(reference_camera >= 0, "reference_camera", reference_camera, "0 or above");
  view.validate();
  subintervals.validate();
  split.validate();
  packets.validate();
  sweep.validate();
  extraction.validate();
  motion.validate();
}

KeyframeMapper::KeyframeMapper(Rig rig, std::vector<int> selected,
                               const KeyframeMapperOptions& options,
                               std::vector<UndistortionTable> undistortion)
    : rig_(std::move(rig)),
      selected_(std::move(selected)),
      options_(options),
      planes_(options.planes),
      groups_(options.split, options.subintervals),
      undistortion_(std::move(undistortion)) {
  options_.validate();
  if (selected_.empty()) throw std::invalid_argument("cameras: at least one must take part");
  requireCamera(rig_, options_.reference_camera, "reference_camera");
  const RigCamera& reference = cameraOf(options_.reference_camera);
  reference.validate();  // it may be none of the selected ones
  view_ = makeReferenceView(reference.model, options_.view);
  for (const int camera : selected_) {
    requireCamera(rig_, camera, "cameras");
    cameraOf(camera).validate();
  }
  if (undistortion_.size() == selected_.size()) return;
  undistortion_.clear();
  tbb::task_arena arena(options_.sweep.threadsOrCores());
  arena.execute([&] {
    for (const int camera : selected_) undistortion_.emplace_back(cameraOf(camera).model);
  });
}

void KeyframeMapper::setPlanes(const DepthPlanesOptions& planes) {
  planes_ = DepthPlanes(planes);
  options_.planes = planes;
}

Rigid3 KeyframeMapper::referencePose(const Rigid3& T_world_rig) const {
  const RigCamera& reference = cameraOf(options_.reference_camera);
  const Rigid3 T_cam_ref{Eigen::Quaterniond::Identity(), options_.view.offset_m};
  return T_world_rig * reference.T_rig_cam * T_cam_ref;
}

// The numbers are the lines of Algorithm 2 (Ghosh and Gallego 2022).
std::optional<KeyframeDepthMap> KeyframeMapper::map(const Window& window,
                                                    const std::vector<EventSpan>& events,
                                                    const Trajectory& trajectory, DsiSink* sink,
                                                    StageHook* stages) {
  // 1. Input: events, trajectory, calibration.
  const std::vector<CameraEvents> all = selectedEvents(events);
  for (const CameraEvents& camera : all) {  // what follows looks up and counts by pixel
    requireInsideSensor(camera.events, camera.camera, camera.calibration->model);
  }
  std::vector<std::vector<Event>> chosen(all.size());
  const std::vector<CameraEvents> cameras =
      withinBudget(all, options_.max_events_per_camera, chosen);
  // 2. One reference view for all DSIs.
  const std::optional<Rigid3> T_world_rig = trajectory.poseAt(window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const WindowInput input{window, cameras, view_, planes_, referencePose(*T_world_rig)};
  // 3-5. From events to depth.
  tbb::task_arena arena(options_.sweep.threadsOrCores());
  const auto map_along = [&](const Trajectory& motion, DsiSink* dsi) {
    return mapAlong(input, motion, dsi, stages);
  };
  KeyframeDepthMap keyframe = arena.execute([&] {
    if (!options_.motion.correct_motion) return map_along(trajectory, sink);
    return mapCorrected({input, trajectory, options_.motion, sink, stages}, map_along);
  });

  keyframe.over_budget = countOf(all) - countOf(cameras);
  sequence_maximum_.add(keyframe.max_confidence);
  if (options_.event_images) {
    for (const CameraEvents& camera : all) keyframe.event_images.push_back(eventImageOf(camera));
  }
  if (options_.view_events) {
    for (const CameraEvents& camera : all) {
      if (camera.camera != options_.reference_camera) continue;
      keyframe.view_events = viewEventsOf(camera, view_, window.t_ref_ns);
    }
  }
  return keyframe;
}

std::vector<CameraEvents> KeyframeMapper::selectedEvents(
    const std::vector<EventSpan>& events) const {
  std::vector<CameraEvents> cameras;
  for (std::size_t i = 0; i < selected_.size(); ++i) {
    const EventSpan& of_camera = events.at(static_cast<std::size_t>(selected_[i]));
    cameras.push_back({selected_[i], &cameraOf(selected_[i]), &undistortion_[i], of_camera});
  }
  return cameras;
}

KeyframeDepthMap KeyframeMapper::mapAlong(const WindowInput& input, const Trajectory& motion,
                                          DsiSink* sink, StageHook* stages) const {
  KeyframeDepthMap keyframe;
  keyframe.window = input.window;
  keyframe.T_world_ref = input.T_world_ref;
  keyframe.view = view_;
  const auto seen = motionIn({input.window, {}, &motion}, rig_, selected_, options_);
  if (seen) keyframe.parallax_px_m = seen->parallax_px_m;
  keyframe.events.resize(rig_.cameras.size());
  std::vector<WindowRays> cameras;
  {
    const StageScope scope(stages, Stage::kSweep);
    cameras = raysOfCameras(input, motion);  // 3.
    countEvents(cameras, keyframe);
    if (options_.exclude_silent) removeSilent(cameras);
  }
  SweepResult swept;
  {
    const StageScope scope(stages, Stage::kSweep);  // apart from the rays, for benchmarks
    swept = fuse(cameras, sink);                    // 4.
  }
  const StageScope scope(stages, Stage::kDepth);
  extract(swept, cameras, keyframe);  // 5.
  return keyframe;
}

/// 3. Divides the window into sub-intervals and back-projects their events, cameras in parallel.
std::vector<WindowRays> KeyframeMapper::raysOfCameras(const WindowInput& input,
                                                      const Trajectory& motion) const {
  std::vector<WindowRays> cameras(input.cameras.size());
  tbb::parallel_for(std::size_t{0}, cameras.size(), [&](std::size_t i) {
    cameras[i] = raysOf(input.cameras[i], input, motion, groups_, options_.packets);
  });
  return cameras;
}

/// 4. Votes, and fuses the DSIs across cameras and time, plane by plane. Consumes the rays.
SweepResult KeyframeMapper::fuse(std::vector<WindowRays>& cameras, DsiSink* sink) const {
  const FusionLayout layout = groups_.layoutOf(static_cast<int>(cameras.size()));
  std::vector<CameraRays> rays = inputsOf(cameras, layout);
  SweepRequest request;
  request.camera_peaks = options_.camera_maps && rays.size() == cameras.size();
  request.sink = sink;
  request.groups = layout.groups;
  const DepthExtractionOptions& extraction = options_.extraction;
  if (usesColumns(extraction.extraction)) request.column_window = extraction.threshold_kernel;
  return sweepSpace(std::move(rays), {view_, planes_}, options_.sweep, request);
}

/// 5. Depth and confidence from the fused DSI.
void KeyframeMapper::extract(const SweepResult& swept, const std::vector<WindowRays>& cameras,
                             KeyframeDepthMap& keyframe) const {
  for (const VoteCounts& votes : swept.votes) keyframe.votes += votes;
  keyframe.max_confidence = maximumOf(swept.fused.peaks.confidence);
  RobustMaximum running_maximum = sequence_maximum_;
  running_maximum.add(keyframe.max_confidence);
  KeyframeFacts facts{{}, keyframe.parallax_px_m};
  facts.sequence_maximum =
      options_.sequence_maximum ? options_.sequence_maximum : running_maximum.value();
  keyframe.map = extractDepth(swept.fused, planes_, options_.extraction, facts);

  if (!options_.camera_maps) return;
  if (swept.cameras.empty()) {  // a single camera: its map is the keyframe's
    keyframe.camera_maps.push_back({cameras.front().camera, keyframe.map});
  }
  for (std::size_t c = 0; c < swept.cameras.size(); ++c) {
    // Without the sequence maximum: the ray densities of one camera differ from fused ones.
    facts.sequence_maximum.reset();
    keyframe.camera_maps.push_back(
        {cameras[c].camera, extractDepth(swept.cameras[c], planes_, options_.extraction, facts)});
  }
}

}  // namespace efm
