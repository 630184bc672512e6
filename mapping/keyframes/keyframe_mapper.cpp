// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_mapper.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/base/thread_arena.h"
#include "mapping/events/event.h"
#include "mapping/motion/slice_alignment.h"
#include "mapping/sweep/plane_choice.h"

namespace efm {

WindowRays raysOf(const CameraEvents& camera, const WindowInput& input,
                  const Trajectory& trajectory, const EventGroups& groups,
                  const PosePacketsOptions& options) {
  const DepthPlanes& planes = input.planes;
  const PacketGeometry geometry{input.T_world_ref.inverse(), input.view, planes.depth(0),
                                planes.depth(planes.size() - 1)};
  WindowRays result;
  result.camera = camera.camera;
  std::vector<std::size_t> rays_in(groups.subintervals());
  PolaritySplit split;
  for (const EventPart& part : groups.partsOf(camera.events, input.window)) {
    const EventSpan events = part.select(split);
    const PosePackets packets = splitIntoPosePackets(
        events, *camera.calibration, *camera.undistortion, trajectory, geometry, options);
    const RayBundle& rays =
        result.rays.emplace_back(backProject(events, packets, *camera.undistortion, input.view));
    result.events += rays.size();
    result.without_pose += packets.without_pose;
    result.outside_lens += events.size() - packets.without_pose - rays.size();
    rays_in[part.subinterval] += rays.size();
  }
  result.silent_subintervals =
      static_cast<std::uint64_t>(std::count(rays_in.begin(), rays_in.end(), std::size_t{0}));
  return result;
}

namespace {

/// Counts the events of all cameras of a keyframe.
void countEvents(const std::vector<WindowRays>& cameras, KeyframeDepthMap& keyframe) {
  for (const WindowRays& camera : cameras) {
    keyframe.events[static_cast<std::size_t>(camera.camera)] = camera.events;
    keyframe.without_pose += camera.without_pose;
    keyframe.outside_lens += camera.outside_lens;
    if (camera.events == 0) {
      keyframe.silent_cameras.push_back(camera.camera);
    } else {
      keyframe.silent_subintervals += camera.silent_subintervals;
    }
  }
}

/// Removes the cameras without rays, unless no camera has any.
void removeSilent(std::vector<WindowRays>& cameras) {
  const auto silent = [](const WindowRays& camera) { return camera.events == 0; };
  if (std::all_of(cameras.begin(), cameras.end(), silent)) return;
  cameras.erase(std::remove_if(cameras.begin(), cameras.end(), silent), cameras.end());
}

/// Returns the contrast of the fused DSI along its peaks: large if all cameras' events meet.
double sharpnessOf(const KeyframeDepthMap& keyframe) {
  return keyframe.map.confidence.dot(keyframe.map.confidence);
}

/// Part of a window around the reference time. There the tracker's errors are small, and the depth
/// of its events has a right scale.
constexpr double kCentral = 0.2;

void requireCamera(const Rig& rig, int camera, const char* key) {
  const auto count = static_cast<int>(rig.cameras.size());
  requireOption(camera >= 0 && camera < count, key, camera,
                "a camera of the recording: 0 to " + std::to_string(count - 1));
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
                               const KeyframeMapperOptions& options)
    : rig_(std::move(rig)),
      selected_(std::move(selected)),
      options_(options),
      planes_(options.planes),
      groups_(options.split, options.subintervals) {
  options_.validate();
  if (selected_.empty()) throw std::invalid_argument("cameras: at least one must take part");
  requireCamera(rig_, options_.reference_camera, "reference_camera");
  const RigCamera& reference = cameraOf(options_.reference_camera);
  reference.validate();  // it may not be a selected camera
  view_ = makeReferenceView(reference.model, options_.view);
  for (const int camera : selected_) {
    requireCamera(rig_, camera, "cameras");
    cameraOf(camera).validate();
  }
  ThreadArena arena(options_.sweep.threadsOrCores());
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
                                                    StageTimes* times) {
  if (keyframes_ % kBlockKeyframes == 0) blur_ = {};
  if (options_.made_earlier) {
    if (std::optional<KeyframeDepthMap> earlier = options_.made_earlier(window)) {
      ++keyframes_;
      blur_ = earlier->blur_watch;
      sequence_maximum_.add(earlier->max_confidence);
      return earlier;
    }
  }
  // 1. Input: events, trajectory, calibration.
  const std::vector<CameraEvents> all = selectedEvents(events);
  std::vector<CameraEvents> cameras = all;
  std::vector<std::vector<Event>> chosen(all.size());
  std::uint64_t over_budget = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::uint32_t max_events = options_.max_events_per_camera;
    cameras[i].events = chooseEvenly(all[i].events, max_events, chosen[i]);
    over_budget += all[i].events.size() - cameras[i].events.size();
  }
  // 2. One reference view for all DSIs.
  const std::optional<Rigid3> T_world_rig = trajectory.poseAt(window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const WindowInput input{window, cameras, view_, planes_, referencePose(*T_world_rig)};
  // 3-5. From events to depth.
  ThreadArena arena(options_.sweep.threadsOrCores());
  KeyframeDepthMap keyframe =
      arena.execute([&] { return mapBest(input, trajectory, sink, times); });

  ++keyframes_;
  keyframe.kernel = nameOf(options_.sweep.kernelOrFastest());
  keyframe.blur_watch = blur_;
  keyframe.T_odom_ref = keyframe.T_world_ref;
  keyframe.T_rig_ref = referencePose({});
  keyframe.over_budget = over_budget;
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
    const RigCamera& calibration = cameraOf(selected_[i]);
    cameras.push_back({selected_[i], &calibration, &undistortion_[i], of_camera});
  }
  return cameras;
}

/// Maps a window, with correction of the motion where the options or the blur of the events call
/// for it.
KeyframeDepthMap KeyframeMapper::mapBest(const WindowInput& input, const Trajectory& tracked,
                                         DsiSink* sink, StageTimes* times) {
  const MotionCorrectionUse use = options_.motion.correct_motion;
  if (use == MotionCorrectionUse::kNever) return mapAlong(input, tracked, sink, times);
  const bool watches = use == MotionCorrectionUse::kAuto;
  const auto corrects = [&] { return !watches || (input.cameras.size() > 1 && blur_.isOn()); };
  if (!corrects() && !blur_.isDue()) {
    blur_.add(std::nullopt);
    return mapAlong(input, tracked, sink, times);
  }
  std::optional<double> looked_px;
  double finest_px = 1;
  cv::Mat1f central_depth;
  {
    const StageScope scope(times, &StageSeconds::motion);
    const CentralPart central(input, kCentral);
    central_depth = mapAlong(central.input(input), tracked, nullptr, nullptr).map.depth;
    if (!corrects()) {
      const SliceAlignment slices(input, tracked, options_.motion, SliceEffort::look());
      const std::optional<AlignedMotion> aligned = slices.align(central_depth, slices.none());
      if (aligned) looked_px = aligned->shift_px;
      if (aligned) finest_px = aligned->finest_px;
      blur_.add(looked_px, finest_px);
    }
  }
  if (!corrects()) {
    KeyframeDepthMap keyframe = mapAlong(input, tracked, sink, times);
    keyframe.blur_px = looked_px;
    return keyframe;
  }
  KeyframeDepthMap keyframe = mapSharpest(input, tracked, central_depth, sink, times, finest_px);
  if (watches && !looked_px) blur_.add(keyframe.blur_px, finest_px);
  if (looked_px) blur_.setLast(keyframe.blur_px.value_or(0), finest_px);
  return keyframe;
}

/// Maps a window along the tracker's motion, then finds the correction of the motion from the depth
/// and maps again along the corrected motion, while the fused DSI becomes sharper. The first
/// correction is from the depth of the window's central part.
/// @param central_depth of that part, along the tracker's motion.
/// @param sink receives only the DSI of the result.
/// @param finest_px is set by each alignment: see AlignedMotion.
KeyframeDepthMap KeyframeMapper::mapSharpest(const WindowInput& input, const Trajectory& tracked,
                                             const cv::Mat1f& central_depth, DsiSink* sink,
                                             StageTimes* times, double& finest_px) const {
  constexpr double kSameMotionPx = 0.25;  // of the finest edges; less does not blur the DSI
  KeyframeDepthMap sharpest = mapAlong(input, tracked, nullptr, times);
  const double sharpness = sharpnessOf(sharpest);
  std::optional<double> blur_px;
  Trajectory motion = tracked;
  {
    const StageScope scope(times, &StageSeconds::motion);
    const SliceAlignment slices(input, tracked, options_.motion);
    for (int round = 0; round < options_.motion.motion_rounds; ++round) {
      const bool is_first = round == 0;
      auto aligned = slices.align(is_first ? central_depth : sharpest.map.depth,
                                  sharpest.motion_correction.value_or(slices.none()));
      // In slow motion the central part may have too few points.
      if (!aligned && is_first) aligned = slices.align(sharpest.map.depth, slices.none());
      if (!aligned) break;
      finest_px = aligned->finest_px;
      if (is_first) blur_px = 0;
      if (aligned->shift_px < kSameMotionPx * finest_px) break;
      Trajectory corrected = correctedTrajectory(tracked, input.window, aligned->correction);
      KeyframeDepthMap sharper = mapAlong(input, corrected, nullptr, nullptr);
      const double min_gain = is_first ? options_.motion.min_gain : 0;
      if (!(sharpnessOf(sharper) > (1 + min_gain) * sharpnessOf(sharpest))) break;
      if (is_first) blur_px = aligned->shift_px;
      motion = std::move(corrected);
      sharpest = std::move(sharper);
      sharpest.motion_correction = std::move(aligned->correction);
    }
  }
  const double gain = sharpness > 0 ? sharpnessOf(sharpest) / sharpness : 1;
  if (sink != nullptr) {
    KeyframeDepthMap again = mapAlong(input, motion, sink, times);
    again.motion_correction = std::move(sharpest.motion_correction);
    sharpest = std::move(again);
  }
  sharpest.blur_px = blur_px;
  sharpest.sharpness_gain = gain;
  return sharpest;
}

KeyframeDepthMap KeyframeMapper::mapAlong(const WindowInput& input, const Trajectory& motion,
                                          DsiSink* sink, StageTimes* times) const {
  KeyframeDepthMap keyframe;
  keyframe.window = input.window;
  keyframe.T_world_ref = input.T_world_ref;
  keyframe.view = view_;
  keyframe.planes = options_.planes;
  keyframe.events.resize(rig_.cameras.size());
  std::vector<WindowRays> cameras(input.cameras.size());
  {
    const StageScope scope(times, &StageSeconds::rays);
    // 3. Divides the window into sub-intervals and back-projects their events, cameras in parallel.
    tbb::parallel_for(std::size_t{0}, cameras.size(), [&](std::size_t i) {
      cameras[i] = raysOf(input.cameras[i], input, motion, groups_, options_.packets);
    });
    countEvents(cameras, keyframe);
    if (options_.exclude_silent) removeSilent(cameras);
  }
  std::vector<int> fused;
  for (const WindowRays& camera : cameras) fused.push_back(camera.camera);
  const auto seen = motionIn({input.window, {}, &motion}, rig_, fused, options_);
  if (seen) keyframe.parallax_px_m = seen->parallax_px_m;
  SweepResult swept;
  {
    const StageScope scope(times, &StageSeconds::sweep);
    swept = fuse(cameras, input.planes, keyframe.parallax_px_m, sink);  // 4.
  }
  const StageScope scope(times, &StageSeconds::depth);
  extract(swept, cameras, input.planes, keyframe);  // 5.
  return keyframe;
}

/// Returns the fusion of the cameras under `FusionRule::kPairs`. Moves the camera to the front that
/// makes pairs with the others: the reference camera, or if it is not selected, the first selected
/// one. If this camera is silent, all others make pairs with each other. The time slices of a
/// single camera have the harmonic mean of them all.
FusionOptions KeyframeMapper::pairsOf(std::vector<WindowRays>& cameras) const {
  FusionOptions fusion = options_.sweep.fusion;
  if (fusion.across_cameras != FusionRule::kPairs) return fusion;
  if (cameras.size() < 3) {
    fusion.across_cameras = FusionRule::kHarmonic;
    return fusion;
  }
  const bool selected =
      std::count(selected_.begin(), selected_.end(), options_.reference_camera) > 0;
  const int zero = selected ? options_.reference_camera : selected_.front();
  const auto first = std::find_if(cameras.begin(), cameras.end(), [zero](const WindowRays& camera) {
    return camera.camera == zero && camera.events > 0;
  });
  fusion.all_pairs = first == cameras.end();
  if (!fusion.all_pairs) std::rotate(cameras.begin(), first, first + 1);
  return fusion;
}

/// 4. Votes, and fuses the DSIs across cameras and time, plane by plane. Consumes the rays.
SweepResult KeyframeMapper::fuse(std::vector<WindowRays>& cameras, const DepthPlanes& planes,
                                 double parallax_px_m, DsiSink* sink) const {
  SpaceSweepOptions sweep = options_.sweep;
  sweep.fusion = pairsOf(cameras);
  const FusionLayout layout = groups_.layoutOf(static_cast<int>(cameras.size()));
  std::vector<CameraRays> rays;
  for (const auto& slots : layout.inputs) {
    CameraRays& input = rays.emplace_back();
    for (const auto& slot : slots) input.push_back(std::move(cameras[slot.camera].rays[slot.part]));
  }
  SweepRequest request;
  request.camera_peaks = options_.camera_maps && rays.size() == cameras.size();
  request.sink = sink;
  request.groups = layout.groups;
  const DepthExtractionOptions& extraction = options_.extraction;
  if (extraction.extraction == ExtractionMethod::kAggregated) {
    request.column_window = extraction.threshold_kernel;
    if (sweep.coarse_to_fine && options_.planes.spacing == PlaneSpacing::kInverse) {
      const double range_px =
          parallax_px_m * (1 / planes.depth(0) - 1 / planes.depth(planes.size() - 1));
      request.coarse_step = coarseStep(planes, view_, range_px);
    }
  }
  return sweepSpace(std::move(rays), {view_, planes}, sweep, request);
}

/// 5. Finds depth and confidence in the fused DSI.
void KeyframeMapper::extract(const SweepResult& swept, const std::vector<WindowRays>& cameras,
                             const DepthPlanes& planes, KeyframeDepthMap& keyframe) const {
  for (const VoteCounts& votes : swept.votes) keyframe.votes += votes;
  cv::minMaxLoc(swept.fused.peaks.confidence, nullptr, &keyframe.max_confidence);
  RobustMaximum running_maximum = sequence_maximum_;
  running_maximum.add(keyframe.max_confidence);
  KeyframeFacts facts{{}, keyframe.parallax_px_m};
  facts.sequence_maximum =
      options_.sequence_maximum ? options_.sequence_maximum : running_maximum.value();
  keyframe.map = extractDepth(swept.fused, planes, options_.extraction, facts);

  if (!options_.camera_maps) return;
  if (swept.cameras.empty()) {  // a single camera: its map is the keyframe's
    keyframe.camera_maps.push_back({cameras.front().camera, keyframe.map});
  }
  for (std::size_t c = 0; c < swept.cameras.size(); ++c) {
    // Without the sequence maximum: the ray densities of one camera differ from fused densities.
    facts.sequence_maximum.reset();
    keyframe.camera_maps.push_back(
        {cameras[c].camera, extractDepth(swept.cameras[c], planes, options_.extraction, facts)});
  }
}

namespace {

/// Returns the distance by which a unit of inverse depth (1/m) moves the view of a camera at
/// `p_view` (metres), in pixels, on average over the view.
double meanParallax(const ReferenceView& view, const Eigen::Vector3d& p_view) {
  constexpr int kGrid = 5;
  double sum = 0;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const Eigen::Vector3d ray =
          view.pointAt((column + 0.5) / kGrid * view.width, (row + 0.5) / kGrid * view.height, 1);
      sum += std::hypot(view.fx * (p_view.x() - ray.x() * p_view.z()),
                        view.fy * (p_view.y() - ray.y() * p_view.z()));
    }
  }
  return sum / (kGrid * kGrid);
}

}  // namespace

std::optional<ViewMotion> motionIn(const WindowData& data, const Rig& rig,
                                   const std::vector<int>& cameras,
                                   const KeyframeMapperOptions& options) {
  const std::optional<Rigid3> T_world_rig = data.trajectory->poseAt(data.window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const auto reference = static_cast<std::size_t>(options.reference_camera);
  const Rigid3& T_rig_view = rig.cameras.at(reference).T_rig_cam;
  const Rigid3 T_view_world = (*T_world_rig * T_rig_view).inverse();
  const ReferenceView view = makeReferenceView(rig.cameras.at(reference).model, options.view);
  ViewMotion motion;
  constexpr int kSteps = 16;
  for (int step = 0; step <= kSteps; ++step) {
    const std::int64_t t_ns =
        data.window.t0_ns + (data.window.t1_ns - data.window.t0_ns) / kSteps * step;
    const std::optional<Rigid3> T_world_then = data.trajectory->poseAt(t_ns);
    if (!T_world_then) continue;
    const Rigid3 T_view_rig = T_view_world * *T_world_then;
    for (const int camera : cameras) {
      const Rigid3& T_rig_cam = rig.cameras.at(static_cast<std::size_t>(camera)).T_rig_cam;
      motion.rig_baseline_m =
          std::max(motion.rig_baseline_m, (T_rig_cam.translation - T_rig_view.translation).norm());
      const double parallax_px_m = meanParallax(view, (T_view_rig * T_rig_cam).translation);
      motion.parallax_px_m = std::max(motion.parallax_px_m, parallax_px_m);
    }
    const Rigid3 T_view_then = T_view_rig * T_rig_view;
    motion.shift_m = std::max(motion.shift_m, T_view_then.translation.norm());
    motion.rotation_rad =
        std::max(motion.rotation_rad, Eigen::AngleAxisd(T_view_then.rotation).angle());
  }
  return motion;
}

}  // namespace efm
