// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/sample_piece.h"

#include <algorithm>
#include <utility>

#include "mapping/events/even_choice.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr double kPieceS = 0.5;
constexpr std::size_t kPieces = 4;

std::vector<std::vector<Event>> thinned(const std::vector<EventSpan>& events) {
  std::vector<std::vector<Event>> all;
  for (const EventSpan& span : events) all.push_back(chosenEvenly(span, kMaxPieceEvents));
  return all;
}

/// One pose instead of those of 20 ms, their mean: the jitter of a tracker is no mistake that is
/// looked for.
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

/// The interval that the events of a sample and its poses share.
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

}  // namespace

std::vector<SamplePiece> piecesOf(const std::vector<WindowSample>& samples,
                                  const TrajectoryOptions& options) {
  std::vector<SamplePiece> pieces;
  const std::size_t of_each = (kPieces + samples.size() - 1) / samples.size();
  for (const WindowSample& sample : samples) {
    const Trajectory trajectory = withoutJitter(sample.trajectory, options);
    const auto [begin_ns, end_ns] = coveredBy(sample, trajectory);
    const std::int64_t whole_ns = end_ns - begin_ns;
    const std::int64_t length_ns =
        std::min({whole_ns, durationFromSeconds(kPieceS),
                  std::max(whole_ns / 2, durationFromSeconds(kPieceS / 2))});
    if (length_ns <= 0) continue;
    for (std::size_t i = 0; i < of_each; ++i) {
      const auto t0_ns = begin_ns + (whole_ns - length_ns) * static_cast<std::int64_t>(2 * i + 1) /
                                        static_cast<std::int64_t>(2 * of_each);
      const Window window{t0_ns, t0_ns + length_ns, t0_ns + length_ns / 2};
      pieces.push_back({window, thinned(eventsWithin(sample, window)), trajectory});
    }
  }
  // Evenly spread; those in the middle first: they have poses for most time shifts.
  std::vector<SamplePiece> chosen;
  const std::size_t count = std::min(kPieces, pieces.size());
  for (const std::size_t i : {1, 2, 0, 3}) {
    if (i < count) chosen.push_back(std::move(pieces[i * pieces.size() / count]));
  }
  return chosen;
}

}  // namespace efm
