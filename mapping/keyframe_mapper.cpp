// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframe_mapper.h"

#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/back_projection.h"
#include "mapping/option_check.h"

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

}  // namespace

void KeyframeMapperOptions::validate() const {
  planes.validate();
  requireOption(reference_camera >= 0, "reference_camera", reference_camera, "0 or above");
  packets.validate();
  sweep.validate();
  extraction.validate();
}

KeyframeMapper::KeyframeMapper(Rig rig, std::vector<int> selected,
                               const KeyframeMapperOptions& options)
    : rig_(std::move(rig)),
      selected_(std::move(selected)),
      options_(options),
      planes_(options.planes),
      sweep_(options.sweep) {
  options_.validate();
  requireCamera(rig_, options_.reference_camera, "reference_camera");
  view_ =
      ReferenceView::of(rig_.cameras[static_cast<std::size_t>(options_.reference_camera)].model);
  for (const int camera : selected_) {
    requireCamera(rig_, camera, "cameras");
    undistortion_.emplace_back(rig_.cameras[static_cast<std::size_t>(camera)].model);
  }
}

std::optional<KeyframeDepthMap> KeyframeMapper::map(const Window& window,
                                                    const std::vector<std::vector<Event>>& events,
                                                    const Trajectory& trajectory, DsiSink* sink,
                                                    StageHook* stages) const {
  // 1-2. The reference view, common to all DSIs.
  const std::optional<Rigid3> T_world_rig = trajectory.poseAt(window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const auto& reference = rig_.cameras[static_cast<std::size_t>(options_.reference_camera)];
  KeyframeDepthMap keyframe;
  keyframe.window = window;
  keyframe.T_world_ref = *T_world_rig * reference.T_rig_cam;
  keyframe.view = view_;
  keyframe.events.resize(rig_.cameras.size());

  SweepResult swept;
  {
    const StageScope scope(stages, Stage::kSweep);
    // 3. Back-project the events of each camera.
    const PacketGeometry geometry{keyframe.T_world_ref.inverse(), view_, planes_.depth(0),
                                  planes_.depth(planes_.size() - 1)};
    std::vector<RayBundle> rays;
    for (std::size_t i = 0; i < selected_.size(); ++i) {
      const auto camera = static_cast<std::size_t>(selected_[i]);
      const PosePackets packets =
          splitIntoPosePackets(events[camera], rig_.cameras[camera], undistortion_[i], trajectory,
                               geometry, options_.packets);
      rays.push_back(backProject(events[camera], packets, undistortion_[i], view_));
      keyframe.events[camera] = rays.back().size();
      keyframe.without_pose += packets.without_pose;
      if (rays.back().size() == 0) keyframe.silent_cameras.push_back(selected_[i]);
    }
    // 4. Vote and fuse, plane by plane.
    swept = sweep_.run(rays, view_, planes_, sink);
  }
  for (const VoteCounts& votes : swept.votes) keyframe.votes += votes;

  // 5. Depth and confidence from the fused DSI.
  const StageScope scope(stages, Stage::kDepth);
  keyframe.map = extractDepth(swept.peaks, planes_, options_.extraction);
  return keyframe;
}

}  // namespace efm
