// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_mapper.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/options/option_check.h"
#include "mapping/rays/back_projection.h"

namespace efm {
namespace {

/// Tells the hook that a stage lasts as long as this object.
class StageScope {
 public:
  StageScope(StageHook* hook, Stage stage) : hook_(hook), stage_(stage) {
    if (hook_ != nullptr) hook_->begin(stage_);
  }
  ~StageScope() {
    if (hook_ != nullptr) hook_->end(stage_);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageHook* hook_;
  Stage stage_;
};

void requireCamera(const Rig& rig, int camera, const char* key) {
  const auto count = static_cast<int>(rig.cameras.size());
  requireOption(camera >= 0 && camera < count, key, camera,
                "a camera of the recording: 0 to " + std::to_string(count - 1));
}

EventImage eventImage(int camera, const CameraModel& model, EventSpan events) {
  EventImage image{camera, cv::Mat_<cv::Vec2i>::zeros(model.height, model.width)};
  for (const Event& event : events) ++image.counts(event.y, event.x)[event.polarity ? 1 : 0];
  return image;
}

double largestOf(const cv::Mat1f& confidence) {
  double largest = 0;
  cv::minMaxLoc(confidence, nullptr, &largest);
  return largest;
}

/// How well the events of all cameras meet: the contrast of the fused DSI along its peaks.
double sharpnessOf(const KeyframeDepthMap& keyframe) {
  return keyframe.map.confidence.dot(keyframe.map.confidence);
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
  const CameraModel& reference =
      rig_.cameras[static_cast<std::size_t>(options_.reference_camera)].model;
  reference.validate();  // it need not be among those that are looked at below
  view_ = makeReferenceView(reference, options_.view);
  for (const int camera : selected_) {
    requireCamera(rig_, camera, "cameras");
    undistortion_.emplace_back(rig_.cameras[static_cast<std::size_t>(camera)].model);
  }
}

Rigid3 KeyframeMapper::referencePose(const Rigid3& T_world_rig) const {
  const auto& reference = rig_.cameras[static_cast<std::size_t>(options_.reference_camera)];
  const Rigid3 T_cam_ref{Eigen::Quaterniond::Identity(), options_.view.offset_m};
  return T_world_rig * reference.T_rig_cam * T_cam_ref;
}

std::optional<KeyframeDepthMap> KeyframeMapper::map(const Window& window,
                                                    const std::vector<EventSpan>& events,
                                                    const Trajectory& trajectory, DsiSink* sink,
                                                    StageHook* stages) {
  // 1-2. The reference view, common to all DSIs.
  const std::optional<Rigid3> T_world_rig = trajectory.poseAt(window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const Scene scene{window, events, referencePose(*T_world_rig)};

  // 3-5. Along the tracker's motion, and along what that should have been.
  const bool corrects = options_.motion.correct_motion;
  KeyframeDepthMap keyframe = mapAlong(trajectory, scene, corrects ? nullptr : sink, stages);
  if (corrects) correctMotion(trajectory, scene, sink, stages, keyframe);
  sequence_maximum_.take(keyframe.largest_confidence);

  if (options_.event_images) {
    for (const int selected : selected_) {
      const auto camera = static_cast<std::size_t>(selected);
      keyframe.event_images.push_back(
          eventImage(selected, rig_.cameras[camera].model, events[camera]));
    }
  }
  return keyframe;
}

/// Steps 3 to 5: from events to depth.
KeyframeDepthMap KeyframeMapper::mapAlong(const Trajectory& trajectory, const Scene& scene,
                                          DsiSink* sink, StageHook* stages) const {
  KeyframeDepthMap keyframe;
  keyframe.window = scene.window;
  keyframe.T_world_ref = scene.T_world_ref;
  keyframe.view = view_;
  keyframe.events.resize(rig_.cameras.size());

  // 3. Back-project the events of each camera and sub-interval, cameras side by side.
  std::vector<CameraInput> inputs(selected_.size());
  {
    const StageScope scope(stages, Stage::kSweep);
    const PacketGeometry geometry{keyframe.T_world_ref.inverse(), view_, planes_.depth(0),
                                  planes_.depth(planes_.size() - 1)};
    tbb::task_arena arena(options_.sweep.threadsOrCores());
    arena.execute([&] {
      tbb::parallel_for(std::size_t{0}, selected_.size(), [&](std::size_t i) {
        inputs[i] = backProjectCamera(i, scene.events[static_cast<std::size_t>(selected_[i])],
                                      scene.window, trajectory, geometry);
      });
    });
  }
  for (const CameraInput& input : inputs) count(input, keyframe);
  fuse(std::move(inputs), sink, stages, keyframe);
  return keyframe;
}

/// Depth and the correction of the motion in turn, as long as the fused DSI becomes sharper.
void KeyframeMapper::correctMotion(const Trajectory& trajectory, const Scene& scene, DsiSink* sink,
                                   StageHook* stages, KeyframeDepthMap& keyframe) const {
  Trajectory motion = trajectory;
  for (int round = 0; round < options_.motion.motion_rounds; ++round) {
    const VelocityCorrection correction = sharpestAlong(motion, scene, stages, keyframe);
    Trajectory corrected = correctedTrajectory(trajectory, scene.window, correction);
    KeyframeDepthMap sharper = mapAlong(corrected, scene, nullptr, stages);
    const double least = keyframe.motion_correction ? 0 : options_.motion.min_gain;
    if (!(sharpnessOf(sharper) > (1 + least) * sharpnessOf(keyframe))) break;
    motion = std::move(corrected);
    keyframe = std::move(sharper);
    keyframe.motion_correction = correction;
  }
  if (sink == nullptr) return;
  const std::optional<VelocityCorrection> correction = keyframe.motion_correction;
  keyframe = mapAlong(motion, scene, sink, stages);
  keyframe.motion_correction = correction;
}

VelocityCorrection KeyframeMapper::sharpestAlong(const Trajectory& motion, const Scene& scene,
                                                 StageHook* stages,
                                                 const KeyframeDepthMap& keyframe) const {
  const StageScope scope(stages, Stage::kSweep);
  constexpr double kSigmaPlanes = 2;  // that a wrong motion makes depths wrong by
  const SharpestMotionInput input{cv::Size(view_.width, view_.height),
                                  kSigmaPlanes * planes_.inverseDepthStep(),
                                  keyframe.motion_correction.value_or(VelocityCorrection{})};
  const auto warped = warpAlong(motion, scene, keyframe);
  tbb::task_arena arena(options_.sweep.threadsOrCores());
  return arena.execute([&] { return sharpestMotion(warped, input, options_.motion); });
}

/// The events of each camera where the keyframe has depth, a bounded number of them; of the cameras
/// that have any.
std::vector<std::vector<WarpedEvent>> KeyframeMapper::warpAlong(
    const Trajectory& motion, const Scene& scene, const KeyframeDepthMap& keyframe) const {
  constexpr double kReachPx = 4;  // a blurred keyframe has its depths that far from where they are
  const NearestDepths depths(keyframe.map.depth, kReachPx);
  std::vector<std::vector<WarpedEvent>> warped(selected_.size());
  if (depths.empty()) return warped;
  std::size_t events = 0;
  for (const int camera : selected_) {
    events += scene.events[static_cast<std::size_t>(camera)].size();
  }
  const auto most = static_cast<std::size_t>(options_.motion.max_events);
  const std::size_t every = std::max<std::size_t>(1, (events + most - 1) / most);
  const WarpTarget target{scene.T_world_ref.inverse(), view_, inversePlanes(planes_), &depths,
                          scene.window.t_ref_ns};
  tbb::task_arena arena(options_.sweep.threadsOrCores());
  arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, selected_.size(), [&](std::size_t i) {
      const auto camera = static_cast<std::size_t>(selected_[i]);
      warped[i] = warpEvents(scene.events[camera], every, rig_.cameras[camera], undistortion_[i],
                             motion, target);
    });
  });
  // With a camera that sees nothing of the keyframe nobody would meet anybody.
  warped.erase(
      std::remove_if(warped.begin(), warped.end(), [](const auto& some) { return some.empty(); }),
      warped.end());
  return warped;
}

KeyframeMapper::CameraInput KeyframeMapper::backProjectCamera(
    std::size_t selected, EventSpan events, const Window& window, const Trajectory& trajectory,
    const PacketGeometry& geometry) const {
  const UndistortionTable& undistortion = undistortion_[selected];
  CameraInput input{selected_[selected], {}};
  std::vector<std::size_t> voting(groups_.subintervals());
  std::vector<Event> of_polarity;
  for (const EventPart& part : groups_.partsOf(events, window)) {
    const EventSpan span = part.select(of_polarity);
    const PosePackets packets =
        splitIntoPosePackets(span, rig_.cameras[static_cast<std::size_t>(input.camera)],
                             undistortion, trajectory, geometry, options_.packets);
    const RayBundle& rays =
        input.rays.emplace_back(backProject(span, packets, undistortion, view_));
    input.without_pose += packets.without_pose;
    input.events += rays.size();
    voting[part.subinterval] += rays.size();
  }
  input.silent_subintervals =
      static_cast<std::uint64_t>(std::count(voting.begin(), voting.end(), 0U));
  return input;
}

/// Counts what became of a camera's events.
void KeyframeMapper::count(const CameraInput& input, KeyframeDepthMap& keyframe) {
  keyframe.events[static_cast<std::size_t>(input.camera)] = input.events;
  keyframe.without_pose += input.without_pose;
  if (input.events == 0) {
    keyframe.silent_cameras.push_back(input.camera);
  } else {
    keyframe.silent_subintervals += input.silent_subintervals;
  }
}

/// Steps 4 and 5: from rays to depth.
void KeyframeMapper::fuse(std::vector<CameraInput> inputs, DsiSink* sink, StageHook* stages,
                          KeyframeDepthMap& keyframe) const {
  const bool all_silent = keyframe.silent_cameras.size() == selected_.size();
  if (options_.exclude_silent && !all_silent) {
    inputs.erase(std::remove_if(inputs.begin(), inputs.end(),
                                [&](const CameraInput& input) {
                                  return keyframe.events[static_cast<std::size_t>(input.camera)] ==
                                         0;
                                }),
                 inputs.end());
  }
  const FusionLayout layout = groups_.layoutOf(static_cast<int>(inputs.size()));
  std::vector<CameraRays> rays;
  for (const auto& slots : layout.inputs) {
    CameraRays& input = rays.emplace_back();
    for (const auto& slot : slots) input.push_back(std::move(inputs[slot.camera].rays[slot.part]));
  }

  // 4. Vote and fuse, plane by plane.
  const bool cameras_apart = rays.size() == inputs.size();  // not slices of a single one
  const bool camera_peaks = options_.camera_maps && cameras_apart;
  const int column_window =
      keepsColumns(options_.extraction.extraction) ? options_.extraction.threshold_kernel : 0;
  SweepResult swept;
  {
    const StageScope scope(stages, Stage::kSweep);
    const SweepRequest request{camera_peaks, sink, layout.groups, column_window};
    swept = sweepSpace(std::move(rays), {view_, planes_}, options_.sweep, request);
  }
  for (const VoteCounts& votes : swept.votes) keyframe.votes += votes;

  // 5. Depth and confidence from the fused DSI.
  const StageScope scope(stages, Stage::kDepth);
  tbb::task_arena arena(options_.sweep.threadsOrCores());
  const auto extract = [&](const SweptDsi& dsi, std::optional<double> sequence_maximum) {
    return arena.execute(
        [&] { return extractDepth(dsi, planes_, options_.extraction, sequence_maximum); });
  };
  keyframe.largest_confidence = largestOf(swept.fused.peaks.confidence);
  RobustMaximum so_far = sequence_maximum_;
  so_far.take(keyframe.largest_confidence);
  const auto sequence_maximum =
      options_.sequence_maximum ? options_.sequence_maximum : so_far.value();
  keyframe.map = extract(swept.fused, sequence_maximum);
  if (options_.camera_maps && !cameras_apart) {
    keyframe.camera_maps.push_back({inputs.front().camera, keyframe.map});
  }
  for (std::size_t c = 0; c < swept.cameras.size(); ++c) {
    // A camera alone has other densities than the fusion: the recording's maximum is not its own.
    keyframe.camera_maps.push_back({inputs[c].camera, extract(swept.cameras[c], std::nullopt)});
  }
}

}  // namespace efm
