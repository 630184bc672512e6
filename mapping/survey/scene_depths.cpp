// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/scene_depths.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

WindowSample sampleOf(const WindowData& data) {
  WindowSample sample;
  sample.window = data.window;
  for (const EventSpan& events : data.events) {
    sample.events.push_back(chosenEvenly(events, kMaxSampleEvents));
  }
  constexpr std::int64_t kMarginNs = kNanosecondsPerSecond / 2;
  sample.trajectory =
      data.trajectory->moved(data.window.t0_ns - kMarginNs, data.window.t1_ns + kMarginNs,
                             [](const StampedPose& pose) { return pose.T_world_rig; });
  return sample;
}

std::vector<EventSpan> eventsWithin(const WindowSample& sample, const Window& window) {
  const auto earlier = [](const Event& event, std::int64_t t_ns) { return event.t_ns < t_ns; };
  std::vector<EventSpan> spans;
  for (const std::vector<Event>& events : sample.events) {
    const auto begin = std::lower_bound(events.begin(), events.end(), window.t0_ns, earlier);
    const auto end = std::lower_bound(begin, events.end(), window.t1_ns, earlier);
    spans.push_back(EventSpan(events).part(static_cast<std::size_t>(begin - events.begin()),
                                           static_cast<std::size_t>(end - events.begin())));
  }
  return spans;
}

WindowData middleOf(const WindowSample& sample, double duration_s) {
  const Window& whole = sample.window;
  const std::int64_t length_ns =
      std::min(durationFromSeconds(duration_s), whole.t1_ns - whole.t0_ns);
  const std::int64_t t0_ns = whole.t0_ns + (whole.t1_ns - whole.t0_ns - length_ns) / 2;
  WindowData middle;
  middle.window = {t0_ns, t0_ns + length_ns, t0_ns + length_ns / 2};
  middle.trajectory = &sample.trajectory;
  middle.events = eventsWithin(sample, middle.window);
  return middle;
}

void SpreadSamples::add(const WindowData& data) {
  if (windows_++ % step_ != 0) return;
  samples_.push_back(sampleOf(data));
  if (samples_.size() <= kMaxSamples) return;
  std::vector<WindowSample> kept;
  for (std::size_t i = 0; i < samples_.size(); i += 2) kept.push_back(std::move(samples_[i]));
  samples_ = std::move(kept);
  step_ *= 2;
}

namespace {

constexpr double kPieceS = 1;
constexpr double kShortPieceS = 0.25;
constexpr std::size_t kPieces = 4;

/// Replaces the poses of each 20 ms by their mean: tracker jitter is not a mistake to search for.
Trajectory withoutJitter(const Trajectory& trajectory, const TrajectoryOptions& options) {
  constexpr std::int64_t kIntervalNs = 20'000'000;
  const std::vector<StampedPose>& poses = trajectory.poses();
  Trajectory mean(options);
  for (std::size_t begin = 0, end = 0; begin < poses.size(); begin = end) {
    const StampedPose& first = poses[begin];
    std::int64_t delay_ns = 0;
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    Eigen::Vector4d rotation = Eigen::Vector4d::Zero();
    for (; end < poses.size() && poses[end].t_ns < first.t_ns + kIntervalNs; ++end) {
      const Rigid3& pose = poses[end].T_world_rig;
      const double sign = pose.rotation.dot(first.T_world_rig.rotation) < 0 ? -1 : 1;
      delay_ns += poses[end].t_ns - first.t_ns;
      translation += pose.translation;
      rotation += sign * pose.rotation.coeffs();
    }
    const auto count = static_cast<std::int64_t>(end - begin);
    mean.add(
        {first.t_ns + delay_ns / count,
         {Eigen::Quaterniond(rotation.normalized()), translation / static_cast<double>(count)}});
  }
  return mean;
}

/// Returns the interval that the events of a sample and its poses share.
std::pair<std::int64_t, std::int64_t> coveredBy(const WindowSample& sample,
                                                const Trajectory& trajectory) {
  const std::vector<StampedPose>& poses = trajectory.poses();
  if (poses.empty()) return {0, 0};
  std::int64_t begin_ns = std::max(sample.window.t0_ns, poses.front().t_ns);
  std::int64_t end_ns = std::min(sample.window.t1_ns, poses.back().t_ns);
  for (const std::vector<Event>& events : sample.events) {
    if (events.empty()) continue;
    begin_ns = std::max(begin_ns, events.front().t_ns);
    end_ns = std::min(end_ns, events.back().t_ns);
  }
  return {begin_ns, std::max(begin_ns, end_ns)};
}

/// @param length_ns length of a piece for the time that a sample covers, and the number of its
/// pieces.
template <typename Length>
std::vector<SamplePiece> piecesOf(const std::vector<WindowSample>& samples,
                                  const TrajectoryOptions& options, std::uint32_t events,
                                  const Length& lengthOf) {
  std::vector<SamplePiece> pieces;
  const std::size_t of_each = (kPieces + samples.size() - 1) / samples.size();
  for (const WindowSample& sample : samples) {
    const Trajectory trajectory = withoutJitter(sample.trajectory, options);
    const auto [begin_ns, end_ns] = coveredBy(sample, trajectory);
    const std::int64_t whole_ns = end_ns - begin_ns;
    const std::int64_t length_ns = lengthOf(whole_ns, static_cast<std::int64_t>(of_each));
    if (length_ns <= 0) continue;
    for (std::size_t i = 0; i < of_each; ++i) {
      const auto t0_ns = begin_ns + (whole_ns - length_ns) * static_cast<std::int64_t>(2 * i + 1) /
                                        static_cast<std::int64_t>(2 * of_each);
      const Window window{t0_ns, t0_ns + length_ns, t0_ns + length_ns / 2};
      SamplePiece& piece = pieces.emplace_back(SamplePiece{window, {}, trajectory});
      for (const EventSpan& of_camera : eventsWithin(sample, window)) {
        piece.events.push_back(chosenEvenly(of_camera, events));
      }
    }
  }
  // The pieces are evenly spread. The pieces in the middle come first: they have poses for most
  // time shifts.
  std::vector<SamplePiece> chosen;
  const std::size_t count = std::min(kPieces, pieces.size());
  for (const std::size_t i : {1, 2, 0, 3}) {
    if (i < count) chosen.push_back(std::move(pieces[i * pieces.size() / count]));
  }
  return chosen;
}

}  // namespace

std::vector<SamplePiece> piecesOf(const std::vector<WindowSample>& samples,
                                  const TrajectoryOptions& options) {
  return piecesOf(samples, options, kMaxPieceEvents, [](std::int64_t whole_ns, std::int64_t) {
    return std::min({whole_ns, durationFromSeconds(kPieceS),
                     std::max(whole_ns / 2, durationFromSeconds(kShortPieceS))});
  });
}

std::vector<SamplePiece> piecesOf(const std::vector<WindowSample>& samples,
                                  const TrajectoryOptions& options, const PieceSize& size) {
  return piecesOf(samples, options, size.events, [&](std::int64_t whole_ns, std::int64_t count) {
    return std::min(durationFromSeconds(size.max_s), whole_ns / count);
  });
}

namespace {

/// Fewer certain points than a map needs: where poses have errors, far depths are less probable,
/// and the range must reach them.
constexpr double kCoarseProbability = 0.5;
/// At the nearest plane, the distance of the cameras moves the view by this fraction of its width.
/// Nearer objects are hardly seen twice.
constexpr double kNearestMove = 0.5;
constexpr double kFarthestParallaxPx = 0.5;  // beyond it, depth is the same as infinity
constexpr int kMaxCoarsePlanes = 400;

FusionMapperOptions withSmallView(FusionMapperOptions options, const Rig& rig,
                                  const Coarseness& coarseness) {
  KeyframeMapperOptions& coarse = options.keyframe;
  const auto reference = static_cast<std::size_t>(coarse.reference_camera);
  const int width = coarse.view.width.value_or(
      reference < rig.cameras.size() ? rig.cameras[reference].model.width : coarseness.width);
  coarse.view.width = std::min(width, coarseness.width);
  coarse.view.height.reset();
  coarse.max_events_per_camera = coarseness.events;
  coarse.extraction = {};
  coarse.extraction.extraction = coarseness.extraction;
  coarse.extraction.median_size = 1;  // of kPaper: its depths are not used
  coarse.extraction.neighbours = false;
  coarse.extraction.min_probability = kCoarseProbability;
  coarse.motion.correct_motion = MotionCorrectionUse::kNever;
  coarse.camera_maps = false;
  coarse.event_images = false;
  coarse.view_events = false;
  coarse.exclude_silent = true;
  return options;
}

}  // namespace

CoarseSweep::CoarseSweep(const Rig& rig, const FusionMapperOptions& options,
                         const Coarseness& coarseness)
    : options_(withSmallView(options, rig, coarseness)),
      plane_step_px_(coarseness.plane_step_px),
      nearest_m_(coarseness.nearest_m),
      mapper_(rig, selectedCameras(rig, options.cameras), options_.keyframe) {}

std::optional<KeyframeDepthMap> CoarseSweep::map(const WindowData& data) {
  const std::optional<ViewMotion> motion = motionIn(data, mapper_.rig(), options_);
  if (!motion || motion->parallax_px_m <= 0) return std::nullopt;
  const double distance_m = std::max(motion->rig_baseline_m, motion->shift_m);
  const double near_m = distance_m * mapper_.view().fx / mapper_.view().width / kNearestMove;
  DepthPlanesOptions planes;
  planes.min_depth_m = std::max(near_m, nearest_m_);
  planes.max_depth_m =
      std::max(2 * planes.min_depth_m, motion->parallax_px_m / kFarthestParallaxPx);
  planes.num_planes =
      1 + std::min(kMaxCoarsePlanes,
                   static_cast<int>(
                       std::ceil(motion->parallax_px_m / planes.min_depth_m / plane_step_px_)));
  mapper_.setPlanes(planes);
  return mapper_.map(data.window, data.events, *data.trajectory);
}

InverseRange denseRange(const SceneDepths& depths) {
  constexpr double kClutter = 0.5;
  constexpr int kBins = 400;
  std::vector<double> gain(kBins, -kClutter / kBins);
  for (const double inverse : depths.inverse) {
    const int bin = std::min(kBins - 1, static_cast<int>(inverse / depths.nearest * kBins));
    gain[static_cast<std::size_t>(bin)] += 1 / static_cast<double>(depths.inverse.size());
  }
  double sum = 0;
  double best_sum = 0;
  int begin = 0;
  std::pair<int, int> best{0, kBins};
  for (int bin = 0; bin < kBins; ++bin) {
    sum += gain[static_cast<std::size_t>(bin)];
    if (sum > best_sum) {
      best_sum = sum;
      best = {begin, bin + 1};
    }
    if (sum < 0) {
      sum = 0;
      begin = bin + 1;
    }
  }
  const double first = depths.nearest * best.first / kBins;
  const double last = depths.nearest * best.second / kBins;
  const auto& inverse = depths.inverse;
  const auto far = std::lower_bound(inverse.begin(), inverse.end(), first);
  const auto near = std::prev(std::upper_bound(inverse.begin(), inverse.end(), last));
  return {*far, *near};
}

InverseRange limitsAround(const InverseRange& scene) {
  constexpr double kMinMargin = 1.25;
  constexpr double kMinRatio = 10;
  // Space in front of the scene shows ambiguous peaks. Space behind the scene also has the wrong
  // points of weak parallax.
  constexpr double kFarExponent = 0.75;
  const double margin = std::sqrt(kMinRatio * scene.far / scene.near);
  return {scene.far / std::max(kMinMargin, std::pow(margin, kFarExponent)),
          scene.near * std::max(kMinMargin, margin)};
}

SceneDepths sceneDepths(CoarseSweep& sweep, const std::vector<WindowSample>& samples,
                        double window_s) {
  SceneDepths depths;
  std::vector<double> parallaxes_px;
  for (const WindowSample& sample : samples) {
    const std::optional<KeyframeDepthMap> keyframe = sweep.map(middleOf(sample, window_s));
    if (!keyframe) continue;
    for (const float depth_m : keyframe->map.depth) {
      if (!(depth_m > 0)) continue;
      depths.inverse.push_back(1 / static_cast<double>(depth_m));
      parallaxes_px.push_back(keyframe->parallax_px_m * depths.inverse.back());
    }
    const std::uint64_t at_farthest = keyframe->map.pixels.at_farthest;
    parallaxes_px.insert(parallaxes_px.end(), at_farthest, 0);
    depths.farthest.insert(depths.farthest.end(), at_farthest,
                           1 / sweep.planes().depth(sweep.planes().size() - 1));
    depths.nearest = std::max(depths.nearest, 1 / sweep.planes().depth(0));
  }
  std::sort(depths.inverse.begin(), depths.inverse.end());
  if (!parallaxes_px.empty()) depths.parallax_px = upperMedian(parallaxes_px);
  return depths;
}

}  // namespace efm
