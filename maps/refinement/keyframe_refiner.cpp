// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_refiner.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/options/option_check.h"

namespace efm {
namespace {

/// Keyframes with less in common are not registered with each other.
constexpr double kLeastOverlap = 0.1;
/// Fewer pairs, or a smaller share of the points, say nothing.
constexpr std::size_t kLeastInliers = 30;
constexpr double kLeastInlierRatio = 0.3;
/// A registration farther from the prior, in its standard deviations, is taken for a failure.
constexpr double kFarthestFromPrior = 6;
/// Registrations expect at least this share of the errors that the tracker was said to have: one
/// that was exact for long may become worse.
constexpr double kCautiousShare = 0.25;
/// Samples that errors are learnt from: some 25 keyframes.
constexpr std::size_t kMaxSamples = 100;
/// Loops are solved when the map has grown by this share of them.
constexpr std::size_t kLoopShare = 20;
/// A loop whose error is larger, in standard deviations, while it counts in full, says that drift
/// is so many times larger than learnt, and again, up to so many times.
constexpr double kDoubted = 3;
constexpr double kMoreDrift = 3;
constexpr double kLargestDriftFactor = 9;
/// How many times larger than usual the errors of loops may be that are to be solved.
constexpr double kTrusting = 30;
constexpr double kLargestRobustSigmas = 1000;
/// A loop whose error is larger once everything is solved was wrong.
constexpr double kContradicted = 8;

/// Beyond this the differences of poses lose what matters, and their squares overflow.
constexpr double kFarthestM = 1e9;
/// Older keyframes whose overlap is looked at in search of a loop.
constexpr std::size_t kLoopNeighbours = 50;

bool isUsable(const Rigid3& pose) {
  return pose.translation.allFinite() && pose.rotation.coeffs().allFinite() &&
         pose.translation.cwiseAbs().maxCoeff() <= kFarthestM;
}

/// A point in the middle of what a keyframe sees.
Eigen::Vector3d middleOfView(const RefinedKeyframe& keyframe) {
  const double inverse_depth = keyframe.cloud.middleInverseDepth();
  const double depth = inverse_depth > 0 ? 1 / inverse_depth : 0;
  return keyframe.T_world_ref * Eigen::Vector3d(0, 0, depth);
}

}  // namespace

void RefinementOptions::validate() const {
  tracker.validate();
  points.validate();
  registration.validate();
  loop.validate();
  graph.validate();
  requireOption(window >= 1 && window <= 1000, "window", window, "from 1 to 1000 (keyframes)");
  requireOption(map_keyframes >= 1 && map_keyframes <= 100, "map_keyframes", map_keyframes,
                "from 1 to 100");
}

KeyframeRefiner::KeyframeRefiner(const RefinementOptions& options)
    : options_(options), errors_(options.tracker), covariance_(errors_.noiseCovariance()) {
  options_.validate();
}

/// How many times the noise that is expected of all poses this one states.
PoseNoise KeyframeRefiner::timesOthers(const std::optional<PoseNoise>& stated) const {
  if (!stated) return kCommonNoise;
  const auto times = [](double of_this, double of_all) {
    return of_all > 0 ? of_this / of_all : 1;
  };
  return {times(stated->noise_m, options_.tracker.noise_m),
          times(stated->noise_rad, options_.tracker.noise_rad)};
}

void KeyframeRefiner::add(RegistrationCloud cloud, const Rigid3& T_odom_ref,
                          const std::optional<PoseNoise>& stated) {
  const std::size_t number = keyframes_.size();
  const std::string name = "keyframe " + std::to_string(number);
  if (!isUsable(T_odom_ref)) {
    throw std::invalid_argument(name + ": its pose is not finite, or farther than 1e9 m");
  }
  if (stated) {
    requireOption(stated->noise_m >= 0 && std::isfinite(stated->noise_m), name + ": noise_m",
                  stated->noise_m, "0 or above");
    requireOption(stated->noise_rad >= 0 && std::isfinite(stated->noise_rad), name + ": noise_rad",
                  stated->noise_rad, "0 or above");
  }
  RefinedKeyframe keyframe{std::move(cloud), T_odom_ref, T_odom_ref, T_odom_ref};
  keyframe.noise = timesOthers(stated);
  keyframe.first_factor = factors_.size();
  if (number > 0) {
    // 1. Where the tracker says.
    const RefinedKeyframe& last = keyframes_.back();
    const Rigid3 T_last_ref = last.T_odom_ref.inverse() * T_odom_ref;
    keyframe.T_world_ref_denoised = last.T_world_ref_denoised * T_last_ref;
    keyframe.T_world_ref = keyframe.T_world_ref_denoised;
    keyframe.path_length_m = last.path_length_m + T_last_ref.translation.norm();
  }
  keyframes_.push_back(std::move(keyframe));
  if (number == 0) return;

  registerNewest();  // 2.
  const auto window = static_cast<std::size_t>(options_.window);
  takeCovariance(solveFrom(number + 1 > window ? number + 1 - window : 0, options_.graph));  // 3.
  closeLoops();                                                                              // 4.
  if (number > window) keyframes_[number - window - 1].cloud.releaseTree();
}

double KeyframeRefiner::overlapOf(std::size_t newer, std::size_t older) const {
  const RefinedKeyframe& of = keyframes_[newer];
  const RefinedKeyframe& in = keyframes_[older];
  return viewOverlap(of.cloud, in.cloud, in.T_world_ref.inverse() * of.T_world_ref);
}

/// Of these keyframes, those that have most of the newest one's points in view.
std::vector<std::size_t> KeyframeRefiner::bestOverlaps(const std::vector<std::size_t>& older,
                                                       double least, int count) const {
  std::vector<std::pair<double, std::size_t>> ranked;
  for (const std::size_t keyframe : older) {
    const double overlap = overlapOf(keyframes_.size() - 1, keyframe);
    if (overlap >= least) ranked.emplace_back(overlap, keyframe);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  ranked.resize(std::min(ranked.size(), static_cast<std::size_t>(count)));
  std::vector<std::size_t> best;
  for (const auto& [overlap, keyframe] : ranked) best.push_back(keyframe);
  return best;
}

/// The keyframes before one that look nearest to where the newest one looks; a bounded number.
std::vector<std::size_t> KeyframeRefiner::nearestBefore(std::size_t last) const {
  const Eigen::Vector3d middle = middleOfView(keyframes_.back());
  std::vector<std::pair<double, std::size_t>> ranked;
  for (std::size_t i = 0; i < last; ++i) {
    ranked.emplace_back((middleOfView(keyframes_[i]) - middle).squaredNorm(), i);
  }
  const auto end =
      ranked.begin() + static_cast<std::ptrdiff_t>(std::min(ranked.size(), kLoopNeighbours));
  std::partial_sort(ranked.begin(), end, ranked.end());
  std::vector<std::size_t> nearest;
  for (auto next = ranked.begin(); next != end; ++next) nearest.push_back(next->second);
  return nearest;
}

TrackerErrors KeyframeRefiner::cautiousErrors() const {
  const TrackerErrors& expected = options_.tracker;
  return {std::max(errors_.noise_m, kCautiousShare * expected.noise_m),
          std::max(errors_.noise_rad, kCautiousShare * expected.noise_rad),
          std::max(errors_.drift_m, kCautiousShare * expected.drift_m),
          std::max(errors_.drift_rad, kCautiousShare * expected.drift_rad)};
}

void KeyframeRefiner::registerNewest() {
  const std::size_t number = keyframes_.size() - 1;
  RefinedKeyframe& newest = keyframes_[number];
  const auto window = static_cast<std::size_t>(options_.window);
  std::vector<std::size_t> last(std::min(number, window));
  std::iota(last.begin(), last.end(), number - last.size());
  std::vector<MapKeyframe> map;
  for (const std::size_t i : bestOverlaps(last, kLeastOverlap, options_.map_keyframes)) {
    map.push_back({i, &keyframes_[i].cloud, keyframes_[i].T_world_ref});
  }
  const TrackerErrors errors = cautiousErrors();
  const Matrix6d covariance =
      errors.noiseCovariance() + errors.noiseCovariance(newest.noise) +
      errors.driftCovariance(newest.path_length_m - keyframes_[number - 1].path_length_m);
  const Registration registration =
      registerKeyframe(number, newest.cloud, map, {newest.T_world_ref, sqrtInformation(covariance)},
                       options_.registration);
  if (registration.inliers < kLeastInliers || registration.inlierRatio() < kLeastInlierRatio ||
      registration.from_prior > kFarthestFromPrior) {
    return;
  }
  ++counts_.registered;
  newest.T_world_ref = registration.T_world_ref;
  for (const RelativePoseFactor& factor : registration.factors) {
    factors_.push_back(factor);
    learnFrom(factor);
  }
  if (options_.adapt_tracker) {
    errors_ = estimateTrackerErrors({samples_.begin(), samples_.end()}, options_.tracker);
  }
}

/// Holds the tracker's motion against the one that a registration found.
void KeyframeRefiner::learnFrom(const RelativePoseFactor& factor) {
  const RefinedKeyframe& from = keyframes_[factor.from];
  const RefinedKeyframe& to = keyframes_[factor.to];
  constexpr double kOpenVariance = 1;  // of directions that the points leave open, m^2 and rad^2
  const MotionEstimate motion = motionOf(factor, kOpenVariance);
  MotionSample sample;
  sample.covariance = motion.covariance;
  sample.difference =
      differenceOf(motion.T_from_to.inverse() * (from.T_odom_ref.inverse() * to.T_odom_ref));
  sample.path_length_m = to.path_length_m - from.path_length_m;
  sample.from = from.noise;
  sample.to = to.noise;
  samples_.push_back(sample);
  if (samples_.size() > kMaxSamples) samples_.pop_front();
}

/// Solves the keyframes from this one on, but never the first.
WindowGraph KeyframeRefiner::solveFrom(std::size_t first_free, const PoseGraphOptions& graph) {
  first_free = std::max<std::size_t>(first_free, 1);
  WindowGraph window(keyframes_, first_free);
  for (std::size_t f = keyframes_[first_free].first_factor; f < factors_.size(); ++f) {
    window.add(factors_[f]);
  }
  TrackerErrors tracker = errors_;
  tracker.drift_m *= drift_factor_;
  tracker.drift_rad *= drift_factor_;
  window.addTracker(tracker);
  window.solve(graph);
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (!window.has(i)) continue;
    RefinedKeyframe& keyframe = keyframes_[i];
    keyframe.T_world_ref_denoised = window.T_world_ref_denoised(i);
    if (i < first_free) continue;
    keyframe.moved = keyframe.moved || !isSame(keyframe.T_world_ref, window.T_world_ref(i));
    keyframe.T_world_ref = window.T_world_ref(i);
  }
  return window;
}

/// What a window that was solved says of the newest keyframe.
void KeyframeRefiner::takeCovariance(const WindowGraph& window) {
  const std::size_t newest = keyframes_.size() - 1;
  // What cannot be computed is what the whole way adds.
  covariance_ = window.trackedCovariance(options_.graph, newest)
                    .value_or(errors_.driftCovariance(keyframes_[newest].path_length_m)) +
                errors_.noiseCovariance(keyframes_[newest].noise);
}

bool KeyframeRefiner::check(const LoopCandidate& candidate) {
  const RefinedKeyframe& older = keyframes_[candidate.older];
  const RefinedKeyframe& newer = keyframes_[candidate.newer];
  ++counts_.loop_checks;
  const TrackerErrors errors = cautiousErrors();
  const Matrix6d covariance =
      errors.noiseCovariance(older.noise) + errors.noiseCovariance(newer.noise) +
      errors.driftCovariance(std::abs(newer.path_length_m - older.path_length_m));
  const std::optional<RelativePoseFactor> factor = verifyLoop(
      candidate, older.cloud, newer.cloud, covariance, options_.loop, options_.registration);
  for (const std::size_t keyframe : {candidate.older, candidate.newer}) {
    if (keyframe + static_cast<std::size_t>(options_.window) < keyframes_.size()) {
      keyframes_[keyframe].cloud.releaseTree();
    }
  }
  if (!factor) return false;
  factors_.push_back(*factor);
  ++counts_.loops;
  const std::size_t oldest = std::min(candidate.older, candidate.newer);
  open_loop_ = std::min(open_loop_.value_or(oldest), oldest);
  return true;
}

bool KeyframeRefiner::propose(const LoopCandidate& candidate) {
  const auto require = [&](std::size_t keyframe, const char* name) {
    requireOption(keyframe < keyframes_.size(), name, keyframe,
                  "the number of a keyframe, below " + std::to_string(keyframes_.size()));
  };
  require(candidate.older, "older keyframe of a loop");
  require(candidate.newer, "newer keyframe of a loop");
  requireOption(candidate.older != candidate.newer, "newer keyframe of a loop", candidate.newer,
                "another one than the older one");
  return check(candidate);
}

void KeyframeRefiner::closeLoops() {
  const std::size_t number = keyframes_.size() - 1;
  const auto window = static_cast<std::size_t>(options_.window);
  if (options_.loop.loops && options_.loop.loop_checks > 0 && number > window) {
    for (const std::size_t older :
         bestOverlaps(nearestBefore(number - window), options_.loop.loop_min_overlap,
                      options_.loop.loop_checks)) {
      check({older, number,
             keyframes_[older].T_world_ref.inverse() * keyframes_[number].T_world_ref});
    }
  }
  if (!open_loop_ || (number - solved_loops_at_) * kLoopShare < number - *open_loop_) return;
  solveLoops();
  solved_loops_at_ = number;
}

/// The loops that are contradicted by so many standard deviations, or more.
std::vector<RelativePoseFactor*> KeyframeRefiner::contradicted(double sigmas) {
  std::vector<RelativePoseFactor*> loops;
  for (RelativePoseFactor& factor : factors_) {
    if (factor.robust && errorOf(factor, keyframes_[factor.from].T_world_ref,
                                 keyframes_[factor.to].T_world_ref) > sigmas) {
      loops.push_back(&factor);
    }
  }
  return loops;
}

/// Solves everything since the oldest loop that is open.
void KeyframeRefiner::solveLoops() {
  // From far off a loop would count as a mistake: at first it counts in full. Where loops do not
  // fit even so, drift is larger than short ways told.
  PoseGraphOptions trusting = options_.graph;
  trusting.robust_sigmas = std::min(kTrusting * trusting.robust_sigmas, kLargestRobustSigmas);
  solveFrom(*open_loop_, trusting);
  while (drift_factor_ < kLargestDriftFactor && !contradicted(kDoubted).empty()) {
    drift_factor_ *= kMoreDrift;
    solveFrom(*open_loop_, trusting);
  }
  takeCovariance(solveFrom(*open_loop_, options_.graph));
  dropContradicted();
  open_loop_.reset();
}

/// Takes out loops that the other factors do not agree with, and solves again without them.
void KeyframeRefiner::dropContradicted() {
  const std::vector<RelativePoseFactor*> wrong = contradicted(kContradicted);
  for (RelativePoseFactor* factor : wrong) {
    factor->sqrt_information.setZero();  // stays in its place, says nothing
    factor->offset.setZero();
  }
  if (wrong.empty()) return;
  counts_.loops_dropped += wrong.size();
  takeCovariance(solveFrom(*open_loop_, options_.graph));
}

void KeyframeRefiner::finish() {
  if (keyframes_.size() < 2) return;
  open_loop_ = 1;
  solveLoops();
}

std::vector<std::size_t> KeyframeRefiner::takeMoved() {
  std::vector<std::size_t> moved;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (std::exchange(keyframes_[i].moved, false)) moved.push_back(i);
  }
  return moved;
}

Rigid3 KeyframeRefiner::T_world_odom() const {
  if (keyframes_.empty()) return {};
  return keyframes_.back().T_world_ref_denoised * keyframes_.back().T_odom_ref.inverse();
}

Rigid3 KeyframeRefiner::T_world_ref_denoised() const {
  return keyframes_.empty() ? Rigid3{} : keyframes_.back().T_world_ref_denoised;
}

}  // namespace efm
