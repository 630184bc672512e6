// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/rendered_frames.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::studies {

PosedFrames renderedFrames(const Scene& scene, const CameraModel& camera,
                           const std::vector<StampedPose>& poses,
                           const RenderedFramesOptions& options) {
  const FrameRenderer renderer(camera);
  const FrameUndistortion undistort(camera);
  cv::RNG random(options.seed);
  PosedFrames sequence{ReferenceView::of(camera), {}};
  for (const StampedPose& pose : poses) {
    Frame rendered;
    renderer.render(renderer.viewFrom(scene, pose.T_world_rig), rendered);
    cv::Mat1f grey;
    cv::exp(rendered.log_intensity, grey);
    grey *= options.grey;
    if (options.noise_grey > 0) {
      cv::Mat1f noise(grey.size());
      random.fill(noise, cv::RNG::NORMAL, 0, options.noise_grey);
      grey += noise;
      for (float& value : grey) value = std::round(std::clamp(value, 0.0F, 255.0F));
    }
    PosedFrame frame = undistort(grey);
    frame.t_ns = pose.t_ns;
    frame.T_world_cam = pose.T_world_rig;
    sequence.frames.push_back(std::move(frame));
  }
  return sequence;
}

}  // namespace efm::studies
