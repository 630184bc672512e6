// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/pose_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "mapping/survey/scene_depths.h"

namespace efm {
namespace {

// Measured on six simulated recordings and a real one, right and with each mistake: the figures are
// in README.md.
constexpr double kMinGain = 1.15;      // of a mistake that is reported
constexpr double kMinShiftGain = 1.1;  // of a time shift: other times of a smooth motion are alike
constexpr double kMinDistinction = 1.4;  // of the best poses from typical wrong ones
constexpr double kMinExplained = 1.25;   // of right poses from typical wrong ones, several cameras
constexpr double kEqual = 0.97;          // of the best gain: as good
constexpr double kPieceS = 0.5;
constexpr std::size_t kPieces = 4;
constexpr double kMinShiftM = 0.005;  // within a piece; as the warning `no-motion`
constexpr double kMaxTimeShiftS = 0.5;
constexpr double kTimeStepS = 0.05;
constexpr double kFinestTimeStepS = 0.001;

/// A short part of a sample.
struct Piece {
  Window window;
  std::vector<EventSpan> events;
  const Trajectory* trajectory;
};

/// The interval that the events of a sample and its poses share.
std::pair<std::int64_t, std::int64_t> coveredBy(const WindowSample& sample) {
  const std::vector<StampedPose>& poses = sample.trajectory.poses();
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

std::vector<Piece> piecesOf(const std::vector<WindowSample>& samples) {
  std::vector<Piece> pieces;
  const std::size_t of_each = (kPieces + samples.size() - 1) / samples.size();
  for (const WindowSample& sample : samples) {
    const auto [begin_ns, end_ns] = coveredBy(sample);
    const std::int64_t whole_ns = end_ns - begin_ns;
    const std::int64_t length_ns =
        std::min({whole_ns, durationFromSeconds(kPieceS),
                  std::max(whole_ns / 2, durationFromSeconds(kPieceS / 2))});
    if (length_ns <= 0) continue;
    for (std::size_t i = 0; i < of_each; ++i) {
      const auto t0_ns = begin_ns + (whole_ns - length_ns) * static_cast<std::int64_t>(2 * i + 1) /
                                        static_cast<std::int64_t>(2 * of_each);
      const Window window{t0_ns, t0_ns + length_ns, t0_ns + length_ns / 2};
      pieces.push_back({window, eventsWithin(sample, window), &sample.trajectory});
    }
  }
  // Evenly spread.
  std::vector<Piece> chosen;
  for (std::size_t i = 0; i < std::min(kPieces, pieces.size()); ++i) {
    chosen.push_back(pieces[i * pieces.size() / std::min(kPieces, pieces.size())]);
  }
  return chosen;
}

/// A mistake, and how to undo it.
struct Hypothesis {
  PoseMistake mistake;
  std::function<Rigid3(const Rigid3&)> T_world_rig;  // from the pose as it is; empty: as it is
  Eigen::Matrix3d R_body_rig = Eigen::Matrix3d::Identity();
};

/// All 23 rotations other than none that map axes to axes.
std::vector<Eigen::Matrix3d> axisRotations() {
  std::vector<Eigen::Matrix3d> rotations;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        rotation(row, order[static_cast<std::size_t>(row)]) = (signs >> row) % 2 == 0 ? 1 : -1;
      }
      if (rotation.determinant() > 0 && !rotation.isIdentity()) rotations.push_back(rotation);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return rotations;
}

std::vector<Hypothesis> poseHypotheses() {
  std::vector<Hypothesis> all;
  all.push_back({PoseMistake::kInverted, [](const Rigid3& pose) { return pose.inverse(); }});
  all.push_back({PoseMistake::kQuaternionOrder, [](const Rigid3& pose) {
                   const Eigen::Quaterniond& q = pose.rotation;
                   return Rigid3{{q.x(), q.y(), q.z(), q.w()}, pose.translation};
                 }});
  for (const Eigen::Matrix3d& rotation : axisRotations()) {
    const Rigid3 T_body_rig{Eigen::Quaterniond(rotation), Eigen::Vector3d::Zero()};
    all.push_back({PoseMistake::kAxes,
                   [T_body_rig](const Rigid3& pose) { return pose * T_body_rig; }, rotation});
  }
  return all;
}

/// The rig with the other transform between its first two cameras.
Rig withInvertedStereo(Rig rig) {
  const Rigid3 T_cam0_cam1 = rig.cameras[0].T_rig_cam.inverse() * rig.cameras[1].T_rig_cam;
  rig.cameras[1].T_rig_cam = rig.cameras[0].T_rig_cam * T_cam0_cam1.inverse();
  return rig;
}

bool takesPart(int camera, const FusionMapperOptions& options) {
  const std::vector<int>& cameras = options.cameras;
  return cameras.empty() || std::find(cameras.begin(), cameras.end(), camera) != cameras.end();
}

/// The options of the sharpness: the cameras of the map, in a small view.
FusionMapperOptions sharpnessOptions(const FusionMapperOptions& options) {
  FusionMapperOptions result;
  result.cameras = options.cameras;
  result.keyframe.reference_camera = options.keyframe.reference_camera;
  result.keyframe.sweep.threads = options.keyframe.sweep.threads;
  result.keyframe.sweep.kernel = options.keyframe.sweep.kernel;
  result.keyframe.packets.packet_error_px = 0.1;
  return result;
}

/// Measures how well poses and rig explain events: the squares of the DSI's confidences (the
/// largest fused value of each pixel), relative to the number of events. Rays that meet in few
/// points give few large values.
class Sharpness {
 public:
  Sharpness(const Rig& rig, const FusionMapperOptions& options)
      : rig_(rig), options_(sharpnessOptions(options)), sweep_(rig, options_, kCoarseness) {}

  bool moves(const Piece& piece) const {
    const auto motion = motionIn({piece.window, piece.events, piece.trajectory}, rig_, options_);
    return motion && motion->shift_m >= kMinShiftM;
  }
  double of(const Piece& piece, const Trajectory& trajectory) {
    const auto keyframe = sweep_.map({piece.window, piece.events, &trajectory});
    if (!keyframe) return 0;
    double events = 0;
    for (const std::uint64_t count : keyframe->events) events += static_cast<double>(count);
    if (events == 0) return 0;
    const cv::Mat1f& confidence = keyframe->map.confidence;
    return confidence.dot(confidence) / (events * events);
  }
  double of(const Piece& piece, const Hypothesis& hypothesis) {
    const auto moved = [&](const StampedPose& pose) {
      return hypothesis.T_world_rig(pose.T_world_rig);
    };
    return of(piece, piece.trajectory->moved(piece.window.t0_ns, piece.window.t1_ns, moved));
  }

 private:
  static constexpr Coarseness kCoarseness{160, 20'000, 2};
  Rig rig_;
  FusionMapperOptions options_;
  CoarseSweep sweep_;
};

/// Gains of one hypothesis over the poses as they are: a logarithm per piece.
struct Gains {
  std::vector<double> logs;

  void add(double sharpness, double as_given) {
    logs.push_back(std::log(std::max(sharpness, 1e-3 * as_given) / as_given));
  }
  double mean() const {
    double sum = 0;
    for (const double log : logs) sum += log;
    return logs.empty() ? 0 : std::exp(sum / static_cast<double>(logs.size()));
  }
  /// Whether most pieces are sharper by half of the gain.
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
    for (Piece& piece : piecesOf(samples)) {
      if (!sharpness_.moves(piece)) continue;
      const double as_given = sharpness_.of(piece, *piece.trajectory);
      if (as_given <= 0) continue;
      pieces_.push_back(std::move(piece));
      as_given_.push_back(as_given);
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
    for (const Hypothesis& hypothesis : poseHypotheses()) {
      Candidate candidate;
      candidate.finding.mistake = hypothesis.mistake;
      candidate.finding.R_body_rig = hypothesis.R_body_rig;
      compare([&](const Piece& piece) { return sharpness_.of(piece, hypothesis); }, candidate,
              kPromising);
      wrong.push_back(candidate.gains.mean());
      candidates_.push_back(std::move(candidate));
    }
    std::nth_element(wrong.begin(), wrong.begin() + static_cast<std::ptrdiff_t>(wrong.size() / 2),
                     wrong.end());
    typical_wrong_ = wrong[wrong.size() / 2];
  }

  void compareCameras() {
    if (rig_.cameras.size() < 2 || !takesPart(0, options_) || !takesPart(1, options_)) return;
    Candidate swapped;
    swapped.finding.mistake = PoseMistake::kCamerasSwapped;
    const CameraModel& left = rig_.cameras[0].model;
    const CameraModel& right = rig_.cameras[1].model;
    if (left.width == right.width && left.height == right.height) {
      compare(
          [&](Piece piece) {
            std::swap(piece.events[0], piece.events[1]);
            return sharpness_.of(piece, *piece.trajectory);
          },
          swapped, 1);
      candidates_.push_back(swapped);
    }
    Candidate inverted;
    inverted.finding.mistake = PoseMistake::kStereoInverted;
    Sharpness sharpness(withInvertedStereo(rig_), options_);
    compare([&](const Piece& piece) { return sharpness.of(piece, *piece.trajectory); }, inverted,
            1);
    candidates_.push_back(inverted);
  }

  /// From coarse to fine.
  void compareTimes() {
    Candidate best;
    best.finding.mistake = PoseMistake::kTimeShift;
    double best_gain = 1;
    const auto attempt = [&](double shift_s) {
      Candidate candidate = best;
      candidate.finding.shift_s = shift_s;
      candidate.gains = {};
      for (std::size_t i = 0; i < pieces_.size(); ++i) {
        const Piece& piece = pieces_[i];
        const std::int64_t shift_ns = durationFromSeconds(shift_s);
        const std::vector<StampedPose>& poses = piece.trajectory->poses();
        if (poses.front().t_ns > piece.window.t0_ns + shift_ns ||
            poses.back().t_ns < piece.window.t1_ns + shift_ns) {
          continue;
        }
        Trajectory moved(options_.trajectory);
        for (const StampedPose& pose : poses) moved.add({pose.t_ns - shift_ns, pose.T_world_rig});
        candidate.gains.add(sharpness_.of(piece, moved), as_given_[i]);
      }
      if (2 * candidate.gains.logs.size() <= pieces_.size()) return;
      if (candidate.gains.mean() <= best_gain) return;
      best_gain = candidate.gains.mean();
      best = candidate;
    };
    for (double shift_s = kTimeStepS; shift_s <= kMaxTimeShiftS; shift_s += kTimeStepS) {
      attempt(shift_s);
      attempt(-shift_s);
    }
    for (double step_s = kTimeStepS / 2; step_s >= kFinestTimeStepS; step_s /= 2) {
      const double middle_s = best.finding.shift_s;
      attempt(middle_s - step_s);
      attempt(middle_s + step_s);
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
    const Candidate* found = nullptr;
    double best_gain = 1;
    for (const Candidate& candidate : candidates_)
      best_gain = std::max(best_gain, gainOf(candidate));
    for (const Candidate& candidate : candidates_) {
      if (gainOf(candidate) < kEqual * best_gain || !isClear(candidate)) continue;
      found = &candidate;  // the simplest one comes first
      break;
    }
    if (!found) return unexplained();
    PoseFinding finding = found->finding;
    finding.gain = gainOf(*found);
    for (const Candidate& candidate : candidates_) {
      const PoseMistake other = candidate.finding.mistake;
      if (gainOf(candidate) < kEqual * best_gain || other == finding.mistake) continue;
      if (!isClear(candidate)) continue;
      auto& alternatives = finding.alternatives;
      if (alternatives.empty() || alternatives.back() != other) alternatives.push_back(other);
    }
    return finding;
  }

  static double gainOf(const Candidate& candidate) { return candidate.gains.mean(); }
  bool isClear(const Candidate& candidate) const {
    const bool time = candidate.finding.mistake == PoseMistake::kTimeShift;
    const double min_gain = time ? kMinShiftGain : kMinGain;
    return gainOf(candidate) >= min_gain && candidate.gains.agree(min_gain) &&
           gainOf(candidate) >= kMinDistinction * typical_wrong_;
  }
  std::optional<PoseFinding> unexplained() const {
    if (rig_.cameras.size() < 2 || 1 >= kMinExplained * typical_wrong_) return std::nullopt;
    return PoseFinding{};
  }

  const Rig& rig_;
  const FusionMapperOptions& options_;
  Sharpness sharpness_;
  std::vector<Piece> pieces_;
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
