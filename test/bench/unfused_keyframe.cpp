// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/unfused_keyframe.h"

#include <algorithm>
#include <cstddef>

#include "mapping/kernels/kernels.h"
#include "mapping/rays/rays.h"

namespace efm::bench {

UnfusedKeyframe::UnfusedKeyframe(const Rig& rig, const KeyframeMapperOptions& options)
    : rig_(rig),
      options_(options),
      planes_(options.planes),
      view_(ReferenceView::of(rig.cameras.front().model)) {
  const std::size_t voxels = view_.pixels() * static_cast<std::size_t>(planes_.size());
  for (const RigCamera& camera : rig_.cameras) undistortion_.emplace_back(camera.model);
  volumes_.assign(rig_.cameras.size(), Volume(voxels));
  fused_.resize(voxels);
}

std::optional<DepthMap> UnfusedKeyframe::map(const Window& window,
                                             const std::vector<EventSpan>& events,
                                             const Trajectory& trajectory, StageTimes* times) {
  const std::optional<Rigid3> T_world_rig = trajectory.poseAt(window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const Rigid3 T_world_ref = *T_world_rig * rig_.cameras.front().T_rig_cam;
  const PacketGeometry geometry{T_world_ref.inverse(), view_, planes_.depth(0),
                                planes_.depth(planes_.size() - 1)};

  std::vector<RayBundle> rays;
  {
    const StageScope scope(times, &StageSeconds::rays);
    for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
      const PosePackets packets = splitIntoPosePackets(events[c], rig_.cameras[c], undistortion_[c],
                                                       trajectory, geometry, options_.packets);
      rays.push_back(backProject(events[c], packets, undistortion_[c], view_));
    }
  }
  DsiPeaks peaks;
  {
    const StageScope scope(times, &StageSeconds::sweep);
    for (std::size_t c = 0; c < rays.size(); ++c) vote(rays[c], volumes_[c]);
    fuse();
    peaks = findPeaks();
  }
  const StageScope scope(times, &StageSeconds::depth);
  return extractAsPaper(peaks, planes_, options_.extraction);
}

void UnfusedKeyframe::vote(const RayBundle& rays, Volume& volume) const {
  std::fill(volume.begin(), volume.end(), 0.0F);
  for (int plane = 0; plane < planes_.size(); ++plane) {
    float* const votes = volume.data() + static_cast<std::size_t>(plane) * view_.pixels();
    for (const RayPacket& packet : rays.packets) {
      const PlaneTransfer transfer = transferToPlane(packet, view_, planes_.depth(plane));
      if (!transfer.in_front) continue;
      kernels::voteBilinear(
          {rays.x_inf.data(), rays.y_inf.data()},
          {packet.begin, packet.end, static_cast<float>(transfer.scale),
           static_cast<float>(transfer.offset_x), static_cast<float>(transfer.offset_y)},
          {votes, view_.width, view_.height});
    }
  }
}

/// The harmonic mean of n values, n / (1/a + 1/b + …), is 0 if one of the values is 0.
void UnfusedKeyframe::fuse() {
  copies_ = volumes_;  // the research code passes its volumes by value
  const auto inputs = static_cast<float>(copies_.size());
  for (std::size_t v = 0; v < fused_.size(); ++v) {
    float inverse = 0;
    bool all_voted = true;
    for (const Volume& volume : copies_) {
      all_voted = all_voted && volume[v] > 0;
      inverse += 1 / volume[v];
    }
    fused_[v] = all_voted ? inputs / inverse : 0.0F;
  }
}

/// Returns the largest value along each ray; of equal values the nearest.
DsiPeaks UnfusedKeyframe::findPeaks() const {
  constexpr float kNoValue = -1;
  DsiPeaks peaks{cv::Mat1f(view_.height, view_.width, kNoValue),
                 cv::Mat1i(view_.height, view_.width, 0),
                 cv::Mat1f(view_.height, view_.width, kNoValue),
                 cv::Mat1f(view_.height, view_.width, kNoValue)};
  const std::size_t pixels = view_.pixels();
  const auto values = [&](int plane) {
    return fused_.data() + static_cast<std::size_t>(plane) * pixels;
  };
  auto* const confidence = peaks.confidence.ptr<float>();
  auto* const best = peaks.plane.ptr<int>();
  for (int plane = 0; plane < planes_.size(); ++plane) {
    const float* const value = values(plane);
    for (std::size_t i = 0; i < pixels; ++i) {
      if (value[i] <= confidence[i]) continue;
      confidence[i] = value[i];
      best[i] = plane;
    }
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    if (best[i] > 0) peaks.before.ptr<float>()[i] = values(best[i] - 1)[i];
    if (best[i] + 1 < planes_.size()) peaks.after.ptr<float>()[i] = values(best[i] + 1)[i];
  }
  return peaks;
}

}  // namespace efm::bench
