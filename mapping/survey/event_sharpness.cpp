// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/event_sharpness.h"

#include <cstdint>

namespace efm {
namespace {

// Wider views, more events and finer planes tell hardly more. The paper's extraction is cheaper,
// and depths are of no use here.
constexpr Coarseness kCoarseness{128, kMaxPieceEvents, 2, kNearestSceneM, ExtractionMethod::kPaper};

/// The cameras of the map, in a small view.
FusionMapperOptions sharpnessOptions(const FusionMapperOptions& options) {
  FusionMapperOptions result;
  result.cameras = options.cameras;
  result.keyframe.reference_camera = options.keyframe.reference_camera;
  result.keyframe.sweep.threads = options.keyframe.sweep.threads;
  result.keyframe.sweep.kernel = options.keyframe.sweep.kernel;
  result.keyframe.packets.packet_error_px = 0.1;
  return result;
}

}  // namespace

EventSharpness::EventSharpness(const Rig& rig, const FusionMapperOptions& options)
    : rig_(rig), options_(sharpnessOptions(options)), sweep_(rig, options_, kCoarseness) {}

double EventSharpness::shiftIn(const SamplePiece& piece) const {
  const auto motion = motionIn(piece.along(piece.trajectory), rig_, options_);
  return motion ? motion->shift_m : 0;
}

double EventSharpness::of(const SamplePiece& piece, const Trajectory& trajectory) {
  const auto keyframe = sweep_.map(piece.along(trajectory));
  if (!keyframe) return 0;
  double events = 0;
  for (const std::uint64_t count : keyframe->events) events += static_cast<double>(count);
  if (events == 0) return 0;
  const cv::Mat1f& confidence = keyframe->map.confidence;
  return confidence.dot(confidence) / (events * events);
}

}  // namespace efm
