// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/pose_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/survey/depth_agreement.h"

namespace efm {
std::vector<PoseHypothesis> poseHypotheses() {
  std::vector<PoseHypothesis> all;
  all.push_back({PoseMistake::kInverted, [](const Rigid3& pose) { return pose.inverse(); }});
  all.push_back({PoseMistake::kQuaternionOrder, [](const Rigid3& pose) {
                   const Eigen::Quaterniond& q = pose.rotation;
                   return Rigid3{{q.x(), q.y(), q.z(), q.w()}, pose.translation};
                 }});
  // All 23 rotations that map axes to axes, without the identity.
  std::array<int, 3> order{0, 1, 2};
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        rotation(row, order[static_cast<std::size_t>(row)]) = (signs >> row) % 2 == 0 ? 1 : -1;
      }
      if (rotation.determinant() < 0 || rotation.isIdentity()) continue;
      const Rigid3 T_body_rig{Eigen::Quaterniond(rotation), Eigen::Vector3d::Zero()};
      all.push_back({PoseMistake::kAxes,
                     [T_body_rig](const Rigid3& pose) { return pose * T_body_rig; }, rotation});
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

namespace {

// Limits. They are measured on six simulated recordings and a real one, without and with each
// mistake: the gains are in README.md.
constexpr double kMinGain = 1.15;  // of a mistake that is reported
// One camera for less than `kShortS` seconds: depths can hide mistakes. Right poses have gains up
// to 1.3, the inverted poses of the real slider 1.98.
constexpr double kMinGainOfShort = 1.5;
constexpr double kShortS = 0.6;
// Gain of a time shift: a smooth motion is nearly the same at other times. Depths of a single
// camera follow the noise of poses.
constexpr double kMinShiftGain = 1.02;
constexpr double kMinShiftGainOfOne = 1.1;
constexpr double kMinShiftS = 0.005;  // smallest shift that is reported
constexpr double kMaxLatencyS = 0.1;  // of drivers and trackers; a larger shift means another clock
// Gain of the best poses over typical wrong poses; less for time shifts, which change little.
constexpr double kMinDistinction = 1.45;
constexpr double kMinShiftDistinction = 1.3;
constexpr double kMinExplained = 1.25;  // of right poses over typical wrong poses, several cameras
// In a shorter time, wrong poses differ little from right poses: their gain, measured on parts of
// the recordings with right poses, is up to 0.98 below 0.4 s, 0.80 at 1 s, 0.77 at 1.4 s. The time
// is the sum of the pieces, which overlap: a recording of 0.7 s has 1.4 s.
constexpr double kMinExplainedS = 1.2;
constexpr double kEqual = 0.97;       // of the best gain: counts as equal
constexpr double kBlurred = 1e-6;     // a hundredth of wrong poses' sharpness: no rays meet
constexpr double kMinShiftM = 0.005;  // within a piece; as the warning `no-motion`
constexpr double kMaxTimeShiftS = 0.5;
constexpr double kTimeStepS = 0.05;
constexpr double kFinestTimeStepS = 0.003;  // measured: a peak is found to 1 to 6 ms

/// Gains of one hypothesis over the poses as they are: a logarithm per piece.
struct Gains {
  std::vector<double> logs;

  void add(double sharpness, double as_given) {
    logs.push_back(std::log(std::max(sharpness, 1e-3 * as_given) / as_given));
  }
  double mean() const {
    double sum = 0;
    for (const double log : logs) sum += log;
    return logs.empty() ? 1 : std::exp(sum / static_cast<double>(logs.size()));
  }
  /// Returns whether most pieces are sharper by half of the gain.
  bool agree(double min_gain) const {
    const auto better = std::count_if(logs.begin(), logs.end(),
                                      [&](double log) { return log > 0.5 * std::log(min_gain); });
    return 2 * better > static_cast<std::ptrdiff_t>(logs.size());
  }
};

class PoseCheck {
 public:
  PoseCheck(const Rig& rig, const std::vector<WindowSample>& samples,
            const FusionMapperOptions& options)
      : rig_(rig), options_(options), sharpness_(rig, options) {
    for (SamplePiece& piece : piecesOf(samples, options.trajectory)) {
      if (sharpness_.shiftIn(piece) < kMinShiftM) continue;
      as_given_.push_back(std::max(sharpness_.of(piece, piece.trajectory), kBlurred));
      pieces_.push_back(std::move(piece));
    }
  }

  std::optional<PoseFinding> run() {
    if (pieces_.empty()) return std::nullopt;
    comparePoses();
    compareCameras();
    compareTimes();
    return best();
  }

 private:
  struct Candidate {
    PoseFinding finding;
    Gains gains;
  };

  void comparePoses() {
    // The first half of the pieces excludes most hypotheses.
    constexpr double kPromising = 1.05;
    std::vector<double> wrong;
    for (const PoseHypothesis& hypothesis : poseHypotheses()) {
      Candidate candidate;
      candidate.finding.mistake = hypothesis.mistake;
      candidate.finding.R_body_rig = hypothesis.R_body_rig;
      compare(
          [&](const SamplePiece& piece) {
            const auto moved = [&](const StampedPose& pose) {
              return hypothesis.T_world_rig(pose.T_world_rig);
            };
            const Window& window = piece.window;
            return sharpness_.of(piece, piece.trajectory.moved(window.t0_ns, window.t1_ns, moved));
          },
          candidate, kPromising);
      wrong.push_back(candidate.gains.mean());
      candidates_.push_back(std::move(candidate));
    }
    typical_wrong_ = upperMedian(wrong);
  }

  void compareCameras() {
    if (rig_.cameras.size() < 2 || !isSelected(0, options_.cameras) ||
        !isSelected(1, options_.cameras))
      return;
    const auto both_have_events = [](const SamplePiece& piece) {
      return !piece.events[0].empty() && !piece.events[1].empty();
    };
    if (!std::any_of(pieces_.begin(), pieces_.end(), both_have_events)) return;
    Candidate swapped;
    swapped.finding.mistake = PoseMistake::kCamerasSwapped;
    const CameraModel& left = rig_.cameras[0].model;
    const CameraModel& right = rig_.cameras[1].model;
    if (left.width == right.width && left.height == right.height) {
      compare(
          [&](SamplePiece piece) {
            std::swap(piece.events[0], piece.events[1]);
            return sharpness_.of(piece, piece.trajectory);
          },
          swapped, 1);
      candidates_.push_back(swapped);
    }
    Candidate inverted;
    inverted.finding.mistake = PoseMistake::kStereoInverted;
    Rig rig = rig_;
    const Rigid3 T_cam0_cam1 = rig.cameras[0].T_rig_cam.inverse() * rig.cameras[1].T_rig_cam;
    rig.cameras[1].T_rig_cam = rig.cameras[0].T_rig_cam * T_cam0_cam1.inverse();
    EventSharpness sharpness(rig, options_);
    compare([&](const SamplePiece& piece) { return sharpness.of(piece, piece.trajectory); },
            inverted, 1);
    candidates_.push_back(inverted);
  }

  /// Returns the gains of a time shift of the first `count` pieces, without pieces that lack poses.
  Gains gainsOfShift(double shift_s, std::size_t count) {
    Gains gains;
    const std::int64_t shift_ns = durationFromSeconds(shift_s);
    for (std::size_t i = 0; i < count; ++i) {
      const SamplePiece& piece = pieces_[i];
      const std::vector<StampedPose>& poses = piece.trajectory.poses();
      if (poses.front().t_ns > piece.window.t0_ns + shift_ns ||
          poses.back().t_ns < piece.window.t1_ns + shift_ns) {
        continue;
      }
      Trajectory moved(options_.trajectory);
      for (const StampedPose& pose : poses) moved.add({pose.t_ns - shift_ns, pose.T_world_rig});
      gains.add(sharpness_.of(piece, moved), as_given_[i]);
    }
    if (2 * gains.logs.size() < count) gains.logs.clear();
    return gains;
  }

  /// Searches the best time shift, from coarse to fine.
  void compareTimes() {
    constexpr double kPromising = 1.01;
    Candidate best;
    best.finding.mistake = PoseMistake::kTimeShift;
    const auto attempt = [&](double shift_s, std::size_t count) {
      const Gains gains = gainsOfShift(shift_s, count);
      if (gains.mean() <= best.gains.mean()) return;
      best.finding.shift_s = shift_s;
      best.gains = gains;
    };
    std::vector<double> shifts_s;
    for (int part = 2; part <= 8; part *= 2) shifts_s.push_back(kTimeStepS / part);
    for (double s = kTimeStepS; s <= kMaxTimeShiftS; s += kTimeStepS) shifts_s.push_back(s);
    for (const double shift_s : shifts_s) {
      attempt(shift_s, (pieces_.size() + 1) / 2);
      attempt(-shift_s, (pieces_.size() + 1) / 2);
    }
    if (best.gains.mean() < kPromising) return;
    best.gains = gainsOfShift(best.finding.shift_s, pieces_.size());
    // Half of the distance to the next shift that was tried.
    double step_s = std::min(kTimeStepS, std::abs(best.finding.shift_s)) / 2;
    for (; step_s >= kFinestTimeStepS; step_s /= 2) {
      const double middle_s = best.finding.shift_s;
      attempt(middle_s - step_s, pieces_.size());
      attempt(middle_s + step_s, pieces_.size());
    }
    candidates_.push_back(best);
  }

  template <typename Measure>
  void compare(Measure sharpness_of, Candidate& candidate, double promising) {
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (2 * i >= pieces_.size() && candidate.gains.mean() < promising) return;
      candidate.gains.add(sharpness_of(pieces_[i]), as_given_[i]);
    }
  }

  std::optional<PoseFinding> best() const {
    double best_gain = 1;
    for (const Candidate& candidate : candidates_) {
      if (isClear(candidate)) best_gain = std::max(best_gain, candidate.gains.mean());
    }
    std::optional<PoseFinding> finding;
    for (const Candidate& candidate : candidates_) {
      if (candidate.gains.mean() < kEqual * best_gain || !isClear(candidate)) continue;
      const PoseMistake other = candidate.finding.mistake;
      if (!finding) {  // the simplest mistake comes first
        finding = candidate.finding;
        finding->gain = candidate.gains.mean();
      } else if (other != finding->mistake) {
        auto& alternatives = finding->alternatives;
        if (alternatives.empty() || alternatives.back() != other) alternatives.push_back(other);
      }
    }
    return finding ? finding : unexplained();
  }

  bool isClear(const Candidate& candidate) const {
    const bool time = candidate.finding.mistake == PoseMistake::kTimeShift;
    const double min_shift_gain = severalCameras() ? kMinShiftGain : kMinShiftGainOfOne;
    const double shift_s = std::abs(candidate.finding.shift_s);
    if (time && shift_s < kMinShiftS) return false;
    const bool short_one = !severalCameras() && seenS() < kShortS;
    double min_gain = time ? min_shift_gain : kMinGain;
    if (short_one && (!time || shift_s > kMaxLatencyS)) min_gain = kMinGainOfShort;
    return candidate.gains.mean() >= min_gain && candidate.gains.agree(min_gain) &&
           candidate.gains.mean() >=
               (time ? kMinShiftDistinction : kMinDistinction) * typical_wrong_;
  }
  /// Returns the time from the first to the last event of all pieces.
  double seenS() const {
    std::int64_t t0_ns = pieces_.front().window.t0_ns;
    std::int64_t t1_ns = t0_ns;
    for (const SamplePiece& piece : pieces_) {
      t0_ns = std::min(t0_ns, piece.window.t0_ns);
      t1_ns = std::max(t1_ns, piece.window.t1_ns);
    }
    return secondsBetween(t0_ns, t1_ns);
  }
  bool severalCameras() const { return selectedCameras(rig_, options_.cameras).size() > 1; }
  std::optional<PoseFinding> unexplained() const {
    if (!severalCameras() || 1 >= kMinExplained * typical_wrong_) return std::nullopt;
    double span_s = 0;
    for (const SamplePiece& piece : pieces_) {
      span_s += secondsBetween(piece.window.t0_ns, piece.window.t1_ns);
    }
    if (span_s < kMinExplainedS) return std::nullopt;
    return PoseFinding{};
  }

  const Rig& rig_;
  const FusionMapperOptions& options_;
  EventSharpness sharpness_;
  std::vector<SamplePiece> pieces_;
  std::vector<double> as_given_;  // of each piece
  std::vector<Candidate> candidates_;
  double typical_wrong_ = 0;  // the median gain of the hypotheses: at most one is right
};

}  // namespace

std::optional<PoseFinding> checkPoses(const Rig& rig, const std::vector<WindowSample>& samples,
                                      const FusionMapperOptions& options) {
  if (samples.empty()) return std::nullopt;
  return PoseCheck(rig, samples, options).run();
}

}  // namespace efm
