// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/map_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "mapping/depth/peak_fit.h"

namespace efm {
namespace {

// Fitted to maps of simulated recordings with and without faults: docs/recordings.md.
constexpr double kWrongPerExpected = 1.3;  // the probability knows few of the causes
constexpr double kUsualExpected = 0.035;   // more has a cause that it does not know
constexpr double kWrongPerUnusual = 20;
constexpr double kUsualAgreement = 0.97;
constexpr double kUsualSupport = 0.2;
constexpr double kWrongPerSupport = 0.7;
constexpr double kUsualMotion = 0.5;
constexpr double kWrongPerMotion = 0.3;
constexpr double kWrongByMistake = 0.1;  // of most: trackers, too, make the warnings
constexpr double kWrongOfOne = 0.04;     // one camera: a wrong motion looks like other depths
constexpr double kWrongIfUnchecked = 0.01;
constexpr double kGoodBelow = 0.09;
constexpr double kGoodBelowOfOne = 0.07;
constexpr double kWrongAbove = 0.5;
constexpr double kWorthSaying = 0.05;

constexpr std::uint32_t kMinShared = 100;  // points; fewer tell nothing
constexpr double kFewDepths = 200;
constexpr double kConfirmed = 1000;  // shared points that agree confirm a small parallax
constexpr double kAloneParallaxPx = 2;
constexpr double kMinParallaxPx = 1.5;
constexpr double kMaxAtEnds = 0.4;  // fraction of the pixels with contrast

/// Returns the fraction of wrong depths for a mean of 1 - probability.
double wrongBy(double expected) {
  return std::min(1.0, kWrongPerExpected * expected +
                           kWrongPerUnusual * std::max(0.0, expected - kUsualExpected));
}

double ratio(double part, double whole) { return whole > 0 ? part / whole : 0; }

/// @param keyframes at least one.
std::string badKeyframesText(const std::vector<std::size_t>& keyframes) {
  constexpr std::size_t kMostNamed = 5;
  std::string names;
  for (std::size_t i = 0; i < std::min(kMostNamed, keyframes.size()); ++i) {
    names += fmt::format("{}{}", i == 0 ? "" : ", ", keyframes[i] + 1);
  }
  if (keyframes.size() > kMostNamed) {
    names += fmt::format(" and {} more", keyframes.size() - kMostNamed);
  }
  return fmt::format(
      "keyframe{} {}: much worse than the others; a jump of the tracker? ([map] "
      "min_keyframe_quality leaves such keyframes out)",
      keyframes.size() > 1 ? "s" : "", names);
}

}  // namespace

QualityStatistics::Judged QualityStatistics::judge(const KeyframeDepthMap& keyframe,
                                                   const QualityFacts& facts) {
  if (keyframes_.size() == keyframes_.capacity()) keyframes_.reserve(2 * keyframes_.size() + 1);
  const DepthMap& map = keyframe.map;
  Judged judged;
  Keyframe& added = judged.keyframe;
  std::vector<double> depths_m, errors;
  double wrong = 0, too_far = 0;
  std::uint32_t known = 0;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const double depth_m = map.depth(y, x);
      if (!(depth_m > 0)) continue;
      depths_m.push_back(depth_m);
      too_far += depth_m > facts.sure_depth_m ? 1 : 0;
      errors.push_back(depth_m * std::sqrt(double{map.variance(y, x)}));
      if (map.probability.empty() || std::isnan(map.probability(y, x))) continue;
      wrong += 1 - map.probability(y, x);
      ++known;
    }
  }
  added.depths = static_cast<std::uint32_t>(depths_m.size());
  added.too_far = static_cast<float>(ratio(too_far, added.depths));
  added.wrong = static_cast<float>(ratio(wrong, known));
  if (!depths_m.empty()) {
    constexpr double kMedianOfSigma = 0.67;  // of a normal distribution
    added.depth_error = static_cast<float>(kMedianOfSigma * upperMedian(errors));
    added.parallax_px = static_cast<float>(keyframe.parallax_px_m / upperMedian(depths_m));
  }
  added.before = sharedWithLast(keyframe);
  judged.pixels = map.pixels;
  judged.of.map.depth = map.depth;
  judged.of.view = keyframe.view;
  judged.of.T_world_ref = keyframe.T_world_ref;
  return judged;
}

void QualityStatistics::add(Judged judged) noexcept {
  keyframes_.push_back(judged.keyframe);
  pixels_ += judged.pixels;
  last_ = std::move(judged.of);
}

/// Projects the points of the last keyframe into this keyframe, and compares depths.
QualityStatistics::Shared QualityStatistics::sharedWithLast(
    const KeyframeDepthMap& keyframe) const {
  constexpr double kWithin = 1.105;
  const Rigid3 T_ref_last = keyframe.T_world_ref.inverse() * last_.T_world_ref;
  const cv::Mat1f& depth = keyframe.map.depth;
  const cv::Rect view({}, depth.size());
  Shared result;
  for (int v = 0; v < last_.map.depth.rows; ++v) {
    for (int u = 0; u < last_.map.depth.cols; ++u) {
      const double last_m = last_.map.depth(v, u);
      if (!(last_m > 0)) continue;
      const Eigen::Vector3d p_ref = T_ref_last * last_.view.pointAt(u, v, last_m);
      if (p_ref.z() <= 0) continue;
      const Eigen::Vector2d pixel = keyframe.view.project(p_ref);
      if (!view.contains(cv::Point2d(pixel.x(), pixel.y()))) continue;
      ++result.in_view;
      const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
      bool shared = false, agrees = false;
      for (const float here_m : depth(cv::Rect(at.x - 1, at.y - 1, 3, 3) & view)) {
        shared = shared || here_m > 0;
        agrees = agrees || (here_m < kWithin * p_ref.z() && kWithin * here_m > p_ref.z());
      }
      result.points += shared ? 1 : 0;
      result.agreeing += agrees ? 1 : 0;
    }
  }
  return result;
}

/// Returns the median fraction of points in view that a keyframe shares with the one before it.
double QualityStatistics::usualHits() const {
  std::vector<double> hits;
  for (const Keyframe& keyframe : keyframes_) {
    const Shared& shared = keyframe.before;
    if (shared.in_view >= kMinShared) hits.push_back(ratio(shared.points, shared.in_view));
  }
  return hits.empty() ? 0 : upperMedian(hits);
}

double QualityStatistics::rightShareOf(std::size_t keyframe) {
  constexpr std::size_t kParts = 20;
  if (keyframes_.size() > usual_of_ + usual_of_ / kParts) {
    usual_hits_ = usualHits();
    usual_of_ = keyframes_.size();
  }
  return rightShareOf(keyframe, usual_hits_);
}

std::vector<std::size_t> QualityStatistics::takeBad(std::size_t end, double min_share) {
  std::vector<std::size_t> bad;
  if (min_share <= 0) return bad;
  for (; looked_at_ < end; ++looked_at_) {
    if (rightShareOf(looked_at_) < min_share) bad.push_back(looked_at_);
  }
  return bad;
}

double QualityStatistics::rightShareOf(std::size_t keyframe, double usual_hits) const {
  // A tracker's jump separates a keyframe from one neighbour; a wrong keyframe agrees with none.
  // Pixels that lie beside those of its neighbours agree by chance, but they are few.
  constexpr double kFewHits = 0.7;  // of the usual ones
  const double usual = kFewHits * usual_hits;
  double right = 0;
  bool compared = false;
  for (std::size_t i = keyframe; i <= keyframe + 1 && i < keyframes_.size(); ++i) {
    const Shared& shared = keyframes_[i].before;
    if (shared.in_view < kMinShared) continue;
    compared = true;
    double with_neighbour = std::min(1.0, ratio(ratio(shared.points, shared.in_view), usual));
    if (shared.points >= kMinShared) {
      with_neighbour *= 1 - std::max(0.0, kUsualAgreement - ratio(shared.agreeing, shared.points));
    }
    right = std::max(right, with_neighbour);
  }
  return (compared ? right : 1) * (1 - wrongBy(double{keyframes_[keyframe].wrong}));
}

MapQuality QualityStatistics::quality(const QualityFacts& facts, const DepthPlanesOptions& planes,
                                      std::size_t num_cameras) const {
  MapQuality result;
  double depths = 0, wrong = 0, shared = 0, agreeing = 0, too_far = 0;
  std::vector<double> errors, parallaxes_px;
  const double usual_hits = usualHits();
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    const Keyframe& keyframe = keyframes_[i];
    depths += keyframe.depths;
    wrong += keyframe.depths * double{keyframe.wrong};
    too_far += keyframe.depths * double{keyframe.too_far};
    shared += keyframe.before.points;
    agreeing += keyframe.before.agreeing;
    result.keyframes.push_back(static_cast<float>(rightShareOf(i, usual_hits)));
    if (keyframe.depths == 0) continue;
    errors.push_back(keyframe.depth_error);
    parallaxes_px.push_back(keyframe.parallax_px);
  }
  if (depths == 0) return result;
  const bool compared = shared >= kMinShared;
  if (compared) result.agreement = agreeing / shared;
  result.support = keyframes_.size() > 1 ? shared / depths : 0;
  result.depth_error = upperMedian(errors);
  result.sharpness = facts.sharpness;

  // What makes depths wrong, one beside the other.
  double right = 1;
  std::vector<std::string>& reasons = result.reasons;
  const auto take = [&](double wrong_share, const std::string& reason) {
    right *= 1 - std::max(0.0, wrong_share);
    if (wrong_share > kWorthSaying) reasons.push_back(reason);
  };
  if (!facts.mistake.empty()) take(kWrongByMistake, "see the warning " + facts.mistake);
  if (compared) {
    take(kUsualAgreement - *result.agreement,
         fmt::format("keyframes in a row agree within 10 % in {:.0f} % of the points that they "
                     "share: the clock, the poses or the calibration may be wrong",
                     100 * *result.agreement));
  }
  findBadKeyframes(result);
  if (!result.much_worse.empty()) reasons.push_back(badKeyframesText(result.much_worse));
  take(wrongBy(wrong / depths), "many depths are not sure by themselves");
  if (keyframes_.size() > 1) {
    take(kWrongPerSupport * (kUsualSupport - result.support),
         fmt::format("{:.0f} % of the depths are in two keyframes", 100 * result.support));
  }
  if (facts.motion_agreement) {
    take(kWrongPerMotion * (kUsualMotion - *facts.motion_agreement),
         fmt::format("the depths by all cameras and those by the motion of one agree in {:.0f} %",
                     100 * *facts.motion_agreement));
  }
  const double by_cameras = 1 - (1 - too_far / depths) * (1 - facts.wrong_by_cameras);
  take(by_cameras, fmt::format("the maps of single cameras lie beside each other: the calibration "
                               "between cameras makes {:.0f} % of the depths wrong",
                               100 * by_cameras));
  const bool is_alone = num_cameras < 2;
  if (!facts.unchecked.empty()) take(kWrongIfUnchecked, "");
  if (is_alone) take(kWrongOfOne, "");
  result.wrong_share = 1 - right;

  const double parallax_px = upperMedian(parallaxes_px);
  if (parallax_px < (agreeing < kConfirmed ? kAloneParallaxPx : kMinParallaxPx)) {
    reasons.push_back(
        fmt::format("the parallax of the scene is {:.2g} px in a window", parallax_px));
  }
  const auto candidates = static_cast<double>(pixels_.candidates);
  const double at_nearest = ratio(static_cast<double>(pixels_.at_nearest), candidates);
  const double at_farthest = ratio(static_cast<double>(pixels_.at_farthest), candidates);
  if (at_nearest + at_farthest > kMaxAtEnds) {
    reasons.push_back(fmt::format(
        "{:.0f} % of the pixels with contrast fit best to the nearest plane, {:g} m, and "
        "{:.0f} % to the farthest, {:g} m ([dsi] min_depth_m, max_depth_m)",
        100 * at_nearest, planes.min_depth_m, 100 * at_farthest, planes.max_depth_m));
  }
  if (depths < kFewDepths) reasons.push_back(fmt::format("there are {:.0f} depths", depths));
  reasons.insert(reasons.end(), facts.doubts.begin(), facts.doubts.end());
  if (!facts.unchecked.empty()) reasons.push_back(facts.unchecked);
  if (is_alone && !compared) reasons.push_back("no second keyframe has the same points");
  if (!facts.unchecked.empty() || (is_alone && !compared)) {
    reasons.push_back(is_alone ? "a second camera, 1.5 s or more, or motion sideways would help"
                               : "more time, or a motion that changes, would help");
  }
  const bool is_known = compared || !is_alone;
  result.word = is_known && result.wrong_share > kWrongAbove ? QualityWord::kWrong
                : !reasons.empty() || result.wrong_share > (is_alone ? kGoodBelowOfOne : kGoodBelow)
                    ? QualityWord::kDoubtful
                    : QualityWord::kGood;
  return result;
}

void QualityStatistics::findBadKeyframes(MapQuality& quality) const {
  constexpr float kMuchWorse = 0.6F;  // of the median
  if (keyframes_.size() < 3) return;
  std::vector<double> all(quality.keyframes.begin(), quality.keyframes.end());
  const auto least = kMuchWorse * static_cast<float>(upperMedian(all));
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (quality.keyframes[i] < least && keyframes_[i].depths > 0) quality.much_worse.push_back(i);
  }
}

std::string textOf(const MapQuality& quality) {
  std::string text(nameOf(quality.word));
  if (quality.word != QualityWord::kUnknown) {
    text += fmt::format(": {:.0f} % of the depths wrong by estimate, median error {:.1f} %",
                        100 * quality.wrong_share, 100 * quality.depth_error);
    if (quality.agreement) {
      text += fmt::format("; {:.0f} % are in two keyframes, which agree in {:.0f} %",
                          100 * quality.support, 100 * *quality.agreement);
    }
    if (quality.sharpness) {
      text += fmt::format("; the events are {:.2f} times as sharp as with other clocks or axes",
                          *quality.sharpness);
    }
  }
  if (quality.left_out > 0) {
    text += fmt::format("; {} keyframes are left out of the map", quality.left_out);
  }
  for (const std::string& reason : quality.reasons) text += "; " + reason;
  return text;
}

}  // namespace efm
