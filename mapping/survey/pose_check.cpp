// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/pose_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <locale>
#include <map>
#include <optional>
#include <set>
#include <sstream>
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

// Limits. They are measured on hand-held and flying motions of 0.3 to 4 s, of one camera and of
// two, with right poses and with each mistake: docs/recordings.md.
constexpr double kMinGain = 1.15;       // of a mistake that is reported
constexpr double kMinShiftGain = 1.02;  // of a clock: a smooth motion is the same at other times
constexpr double kMinShiftGainOfOne = 1.03;  // one camera: depths follow the noise of poses
constexpr double kMinShortShiftGain = 1.05;  // in less time than that, or without poses beyond it
constexpr double kMinPixelGain = 1.03;
constexpr double kMinPixelGainOfOne = 1.1;
constexpr double kHopeless = 0.7;        // gain of a piece: other pieces are not tried
constexpr double kHopelessShift = 0.92;  // the same of a clock, relative to the best clock so far
constexpr double kMaxOtherPixels = 0.9;  // the pixels are right
constexpr double kMinShiftS = 0.005;     // smallest shift that is reported
// Gain of the best poses over typical wrong poses; less for clocks, which change little.
constexpr double kMinDistinction = 1.4;
constexpr double kMinShiftDistinction = 1.45;
// Right poses: typical wrong poses are at most 0.75 times as sharp, and none is sharper. In several
// windows of several cameras it is a fault.
constexpr double kMaxTypicalWrong = 0.8;
// Clearly right poses: some hypotheses are enough, and no mirror or far clock is tried.
constexpr double kMaxTypicalClear = 0.75;
constexpr double kMaxBestClear = 0.95;
constexpr double kMaxBesideClear = 0.99;  // of the clocks kClockS beside
constexpr double kMinSeenS = 0.5;
constexpr double kMinMargin = 1.02;     // of the best mistake over the next one
constexpr double kEqual = 0.93;         // of the best gain, in each half of the data
constexpr double kMinSeenOfOneS = 1.3;  // one camera; in less time, wrong mistakes explain as much
constexpr double kClockS = 0.05;    // the clock is known if a shift by it makes events less sharp
constexpr double kMinDrop = 0.005;  // beside a known clock, and beside half of a found one
constexpr double kKnownClockS = 0.025;
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
  double mean() const { return mean(0, logs.size()); }
  double mean(std::size_t begin, std::size_t end) const {
    end = std::min(end, logs.size());
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += logs[i];
    return begin < end ? std::exp(sum / static_cast<double>(end - begin)) : 1;
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
      pieces_.push_back(std::move(piece));
    }
  }

  PoseJudgement run() {
    if (pieces_.empty()) return {{}, "the poses could not be checked: the rig hardly moves"};
    if (!severalCameras() && seenS() < kMinSeenOfOneS) {
      return {{},
              "the poses could not be checked: " + seen() + ", where wrong poses look as right"};
    }
    comparePoses();
    compareCameras();
    compareTimes();
    compareClocks();
    compareAreas();
    compareMirrors();
    PoseJudgement result = judgement();
    best_other_ = std::max(best_other_, best_wrong_);
    if (best_other_ > 0) result.sharpness = 1 / best_other_;
    return result;
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

 private:
  struct Candidate {
    PoseFinding finding;
    Gains gains;
    bool is_peak = true;  // of a clock: it is sharper than clocks beside it
  };

  void comparePoses() {
    // If the poses are much sharper than with the inverse, the other order of the quaternion and a
    // third of the axes, they are right: the other axes are not tried.
    const auto isFirst = [](std::size_t i) { return i < 2 || i % 3 == 2; };
    const std::vector<PoseHypothesis> hypotheses = poseHypotheses();
    std::vector<double> wrong;
    for (const bool first : {true, false}) {
      if (!first && areClear()) return;
      for (std::size_t i = 0; i < hypotheses.size(); ++i) {
        if (isFirst(i) != first) continue;
        wrong.push_back(gainOf(hypotheses[i]));
        best_wrong_ = std::max(best_wrong_, wrong.back());
      }
      typical_wrong_ = upperMedian(wrong);
    }
  }

  double gainOf(const PoseHypothesis& hypothesis) {
    constexpr double kPromising = 1.05;  // the first half of the pieces excludes most hypotheses
    PoseFinding finding{hypothesis.mistake};
    finding.R_body_rig = hypothesis.R_body_rig;
    const auto sharpness = [&](const SamplePiece& piece) {
      const auto moved = [&](const StampedPose& pose) {
        return hypothesis.T_world_rig(pose.T_world_rig);
      };
      const Window& window = piece.window;
      return sharpness_.of(piece, piece.trajectory.moved(window.t0_ns, window.t1_ns, moved));
    };
    return compare(finding, sharpness, kPromising).mean();
  }

  void compareCameras() {
    if (rig_.cameras.size() < 2 || !isSelected(0, options_.cameras) ||
        !isSelected(1, options_.cameras))
      return;
    const auto both_have_events = [](const SamplePiece& piece) {
      return !piece.events[0].empty() && !piece.events[1].empty();
    };
    if (!std::any_of(pieces_.begin(), pieces_.end(), both_have_events)) return;
    const CameraModel& left = rig_.cameras[0].model;
    const CameraModel& right = rig_.cameras[1].model;
    if (left.width == right.width && left.height == right.height) {
      compare({PoseMistake::kCamerasSwapped}, [&](SamplePiece piece) {
        std::swap(piece.events[0], piece.events[1]);
        return sharpness_.of(piece, piece.trajectory);
      });
    }
    Rig rig = rig_;
    const Rigid3 T_cam0_cam1 = rig.cameras[0].T_rig_cam.inverse() * rig.cameras[1].T_rig_cam;
    rig.cameras[1].T_rig_cam = rig.cameras[0].T_rig_cam * T_cam0_cam1.inverse();
    EventSharpness sharpness(rig, options_);
    compare({PoseMistake::kStereoInverted},
            [&](const SamplePiece& piece) { return sharpness.of(piece, piece.trajectory); });
  }

  /// Returns the gains of the first `count` pieces, without those that have no sharpness.
  /// @param least stops where the mean gain of the pieces so far is lower.
  template <typename Sharpness>
  Gains gainsOfFirst(std::size_t count, double least, Sharpness sharpnessOf) {
    Gains gains;
    for (std::size_t i = 0; i < count && (i == 0 || gains.mean() >= least); ++i) {
      if (const std::optional<double> sharpness = sharpnessOf(i)) {
        gains.add(*sharpness, asGiven(i));
      }
    }
    return gains;
  }

  /// Returns the gains of a time shift of the first `count` pieces, without pieces that lack poses.
  /// @param least see `gainsOfFirst`.
  Gains gainsOfShift(double shift_s, std::size_t count, double least = 0) {
    const std::int64_t shift_ns = durationFromSeconds(shift_s);
    return gainsOfFirst(count, least, [&](std::size_t i) -> std::optional<double> {
      const SamplePiece& piece = pieces_[i];
      const std::vector<StampedPose>& poses = piece.trajectory.poses();
      if (poses.front().t_ns > piece.window.t0_ns + shift_ns ||
          poses.back().t_ns < piece.window.t1_ns + shift_ns) {
        return std::nullopt;
      }
      auto known = shifted_.find({shift_ns, i});
      if (known == shifted_.end()) {
        Trajectory moved(options_.trajectory);
        for (const StampedPose& pose : poses) moved.add({pose.t_ns - shift_ns, pose.T_world_rig});
        const double sharpness = shift_ns == 0 ? asGiven(i) : sharpness_.of(piece, moved);
        known = shifted_.emplace(std::pair(shift_ns, i), sharpness).first;
      }
      return known->second;
    });
  }

  /// Searches the best time shift on the first half of the pieces, from coarse to fine.
  /// @param gainsOf returns the gains of a shift, its first argument. It stops where their mean is
  /// below its second argument.
  template <typename GainsOf>
  double bestShift(const std::vector<double>& shifts_s, GainsOf gainsOf) const {
    double best_s = 0;
    double best_gain = 1;
    const auto attempt = [&](double shift_s) {
      const Gains gains = gainsOf(shift_s, kHopelessShift * best_gain);
      if (gains.logs.size() < half() || gains.mean() <= best_gain) return;
      best_s = shift_s;
      best_gain = gains.mean();
    };
    for (const double shift_s : shifts_s) {
      attempt(shift_s);
      attempt(-shift_s);
    }
    // Half of the distance to the next shift that was tried.
    double step_s = std::min(kTimeStepS, std::abs(best_s)) / 2;
    for (; best_gain > 1.005 && step_s >= kFinestTimeStepS; step_s /= 2) {
      const double middle_s = best_s;
      attempt(middle_s - step_s);
      attempt(middle_s + step_s);
    }
    return best_s;
  }

  void compareTimes() {
    std::vector<double> shifts_s = {kTimeStepS / 8, kTimeStepS / 4};
    const auto isWorse = [&](double s) {
      const Gains gains = gainsOfShift(s, half());
      return !gains.logs.empty() && gains.mean() < kMaxBesideClear;
    };
    const bool is_clear = areClear() && isWorse(kClockS) && isWorse(-kClockS);
    if (!is_clear) {
      shifts_s.push_back(kTimeStepS / 2);
      for (double s = kTimeStepS; s <= kMaxTimeShiftS; s += (s < 0.2 ? 1 : 2) * kTimeStepS) {
        shifts_s.push_back(s);
      }
    }
    double best_s =
        bestShift(shifts_s, [&](double s, double least) { return gainsOfShift(s, half(), least); });
    // A gain that is too small for a report is noise if the poses are clearly right.
    if (is_clear && best_s != 0 &&
        gainsOfShift(best_s, pieces_.size()).mean() < minGain(PoseMistake::kTimeShift)) {
      best_s = 0;
    }
    // The clock of clearly right poses needs no proof by the other half of the pieces.
    const std::size_t count = is_clear && best_s == 0 ? half() : pieces_.size();
    const auto gainsOf = [&](double s) {
      Gains gains = gainsOfShift(s, count);
      if (4 * gains.logs.size() < 3 * count) gains.logs.clear();
      return gains;
    };
    Candidate candidate;
    candidate.finding.mistake = PoseMistake::kTimeShift;
    candidate.finding.shift_s = best_s;
    candidate.gains = gainsOf(best_s);
    double drop = candidate.gains.logs.empty() ? 0 : 1;
    bool open = false;  // a side has no poses
    for (const double beside_s : {best_s - kClockS, best_s + kClockS}) {
      const Gains beside = gainsOf(beside_s);
      open = open || beside.logs.empty();
      if (beside.logs.empty()) continue;
      drop = std::min(drop, 1 - beside.mean() / candidate.gains.mean());
      best_other_ = std::max(best_other_, beside.mean());
    }
    candidate.is_peak = drop > 2 * kMinDrop && ((!open && seenS() >= kMinSeenOfOneS) ||
                                                candidate.gains.mean() > kMinShortShiftGain);
    clock_is_known_ = !open && drop > kMinDrop && std::abs(best_s) < kKnownClockS;
    if (candidate.gains.logs.empty()) candidate.gains = gainsOfShift(best_s, half());
    best_shift_gain_ = candidate.gains.mean();
    if (std::abs(best_s) >= kMinShiftS) best_other_ = std::max(best_other_, best_shift_gain_);
    candidates_.push_back(std::move(candidate));
  }

  /// Compares the clocks of the other cameras with that of camera 0.
  void compareClocks() {
    const std::vector<int> cameras = selectedCameras(rig_, options_.cameras);
    for (std::size_t i = 1; i < cameras.size(); ++i) {
      Candidate candidate;
      candidate.finding.mistake = PoseMistake::kCameraClock;
      const auto camera = static_cast<std::size_t>(cameras[i]);
      candidate.finding.camera = camera;
      const auto gainsOf = [&](double shift_s, std::size_t count, double least = 0) {
        return gainsOfFirst(count, least, [&](std::size_t p) -> std::optional<double> {
          SamplePiece piece = pieces_[p];
          for (Event& event : piece.events[camera]) event.t_ns += durationFromSeconds(shift_s);
          return sharpness_.of(piece, piece.trajectory);
        });
      };
      const auto ofHalf = [&](double s, double least) { return gainsOf(s, half(), least); };
      if (bestShift({0.03}, ofHalf) == 0) continue;
      candidate.finding.shift_s = bestShift({0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15}, ofHalf);
      candidate.gains = gainsOf(candidate.finding.shift_s, pieces_.size());
      candidate.is_peak = candidate.gains.mean() > best_shift_gain_;
      candidates_.push_back(std::move(candidate));
    }
  }

  /// Compares other pixels. Events outside of the sensor are left out: the gain counts the others.
  const Gains& comparePixels(const PoseFinding& finding) {
    return compare(finding, [&](SamplePiece piece) {
      double before = 0;
      double after = 0;
      for (std::size_t c = 0; c < piece.events.size(); ++c) {
        const CameraModel& model = rig_.cameras[c].model;
        std::vector<Event> kept;
        for (Event event : piece.events[c]) {
          const Eigen::Vector2i pixel = finding.pixels({event.x, event.y}, model, c);
          event.x = static_cast<std::uint16_t>(pixel.x());  // negative ones become large
          event.y = static_cast<std::uint16_t>(pixel.y());
          if (event.x < model.width && event.y < model.height) kept.push_back(event);
        }
        before += static_cast<double>(piece.events[c].size());
        after += static_cast<double>(kept.size());
        piece.events[c] = std::move(kept);
      }
      return before > 0 ? after / before * sharpness_.of(piece, piece.trajectory) : 0;
    });
  }

  /// Compares mirrored pictures of all cameras.
  void compareMirrors() {
    if (severalCameras() && areClear()) return;
    for (const PixelChange& change :
         {PixelChange{false, true}, PixelChange{false, false, true}, PixelChange{true}}) {
      PoseFinding finding{PoseMistake::kMirrored};
      finding.pixels = change;
      comparePixels(finding);
    }
  }

  /// Returns the number of columns (axis 0) or rows without events, at the begin or the end of a
  /// camera's sensor; 0 if they are few.
  int emptyLines(std::size_t camera, int axis, bool at_end) const {
    constexpr double kMinEmpty = 0.07;  // of all columns or rows; example: 320 of 346 columns
    const CameraModel& model = rig_.cameras[camera].model;
    const int size = axis == 0 ? model.width : model.height;
    std::vector<int> empty;  // beside each event
    for (const SamplePiece& piece : pieces_) {
      for (const Event& event : piece.events[camera]) {
        const int line = axis == 0 ? event.x : event.y;
        empty.push_back(at_end ? size - 1 - line : line);
      }
    }
    if (empty.empty()) return 0;
    const auto stray = empty.begin() + static_cast<std::ptrdiff_t>(empty.size() / 500);
    std::nth_element(empty.begin(), stray, empty.end());
    return *stray < kMinEmpty * size ? 0 : *stray;
  }

  /// Compares pixels that are moved, if the events leave a side of a sensor empty.
  void compareAreas() {
    const CameraModel& first = rig_.cameras[0].model;
    if (2 * emptyLines(0, 0, true) >= first.width - 2 &&
        2 * emptyLines(0, 1, true) >= first.height - 2) {
      area_is_known_ = false;  // binned, probably: no offset explains it
      return;
    }
    for (const int axis : {0, 1}) {
      for (const bool at_end : {false, true}) {
        PoseFinding finding{PoseMistake::kPixels};
        int most = 0;
        for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
          const int lines = emptyLines(c, axis, at_end);
          most = std::max(most, lines);
          finding.pixels.offset_px.emplace_back(0, 0);
          finding.pixels.offset_px[c][axis] = at_end ? lines : -lines;
        }
        if (most == 0) continue;
        // The view of one camera with an empty side shows too little of a motion.
        area_is_known_ =
            comparePixels(finding).mean() < kMaxOtherPixels && area_is_known_ && severalCameras();
      }
    }
  }

  /// Returns the sharpness of a piece with the poses as they are.
  double asGiven(std::size_t piece) {
    for (std::size_t i = as_given_.size(); i <= piece; ++i) {
      as_given_.push_back(std::max(sharpness_.of(pieces_[i], pieces_[i].trajectory), kBlurred));
    }
    return as_given_[piece];
  }

  /// Adds a candidate. @return its gains, of fewer pieces if the first ones are not `promising`.
  template <typename Measure>
  const Gains& compare(const PoseFinding& finding, Measure sharpness_of, double promising = 1) {
    Gains& gains = candidates_.emplace_back(Candidate{finding, {}}).gains;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (i >= half() && gains.mean() < promising) break;
      if (i > 0 && gains.mean() < kHopeless) break;
      gains.add(sharpness_of(pieces_[i]), asGiven(i));
    }
    return gains;
  }

  /// Returns the strongest mistake. Other pixels come first: with wrong pixels, wrong poses may
  /// look sharp.
  const Candidate* strongest() const {
    const Candidate* best = nullptr;
    const auto strength = [](const Candidate& candidate) {
      return std::pair(candidate.finding.mistake == PoseMistake::kPixels, candidate.gains.mean());
    };
    for (const Candidate& candidate : candidates_) {
      if (isClear(candidate) && (!best || strength(candidate) > strength(*best))) best = &candidate;
    }
    return best;
  }

  PoseJudgement judgement() const {
    const Candidate* best = strongest();
    if (best && (severalCameras() || area_is_known_ || isPixels(best->finding.mistake))) {
      return {findingOf(*best)};
    }
    if (!area_is_known_ && severalCameras() && !areExplained()) {
      return {PoseFinding{PoseMistake::kPixels}};
    }
    if (!area_is_known_) {
      return {{},
              "the pixels of the events could not be checked: they leave a side of a sensor empty; "
              "if the pictures are cropped or binned, the calibration must be of these pixels"};
    }
    if (severalCameras() && typical_wrong_ > kMaxTypicalWrong && seenS() >= kMinSeenS) {
      return {PoseFinding{}};
    }
    if (!areExplained()) {
      return {{},
              "the poses could not be checked: in " + seen() +
                  ", wrong poses explain the events nearly as well"};
    }
    if (clock_is_known_) return {};
    return {{},
            "the clock of the poses could not be checked: in " + seen() +
                ", the motion is too even, or the poses end with the events"};
  }
  std::string seen() const {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << std::setprecision(2) << seenS() << " s of "
         << (severalCameras() ? "the cameras" : "one camera");
    return text.str();
  }

  /// Returns a clear mistake, or `kUnknown` if others explain the events as well.
  PoseFinding findingOf(const Candidate& best) const {
    const std::size_t n = pieces_.size();
    const auto isEqual = [&](const Candidate& other) {
      return other.gains.logs.size() == n &&
             (other.gains.mean() * kMinMargin > best.gains.mean() ||
              kEqual * other.gains.mean(0, half()) > best.gains.mean(0, half()) ||
              kEqual * other.gains.mean(half(), n) > best.gains.mean(half(), n));
    };
    PoseFinding finding = best.finding;
    finding.gain = best.gains.mean();
    if (finding.mistake == PoseMistake::kPixels) return finding;
    std::set<PoseMistake> equal;
    for (const Candidate& other : candidates_) {
      const PoseMistake mistake = other.finding.mistake;
      if (isShift(mistake) || mistake == PoseMistake::kPixels || &other == &best) continue;
      if (isEqual(other)) equal.insert(mistake);
    }
    if (equal.empty()) return finding;
    equal.insert(finding.mistake);
    finding.alternatives.assign(equal.begin(), equal.end());
    // With exchanged cameras and with their inverted transform, the map is the same.
    if (finding.alternatives !=
        std::vector{PoseMistake::kCamerasSwapped, PoseMistake::kStereoInverted}) {
      finding.mistake = PoseMistake::kUnknown;
      if (!area_is_known_) finding.alternatives.push_back(PoseMistake::kPixels);
    }
    return finding;
  }

  static bool isPixels(PoseMistake mistake) {
    return mistake == PoseMistake::kPixels || mistake == PoseMistake::kMirrored;
  }
  static bool isShift(PoseMistake mistake) {
    return mistake == PoseMistake::kTimeShift || mistake == PoseMistake::kCameraClock;
  }

  double minGain(PoseMistake mistake) const {
    if (isShift(mistake)) return severalCameras() ? kMinShiftGain : kMinShiftGainOfOne;
    if (mistake != PoseMistake::kPixels) return kMinGain;
    return severalCameras() ? kMinPixelGain : kMinPixelGainOfOne;
  }

  /// Returns whether a mistake explains the events, on both halves of the data.
  bool isClear(const Candidate& candidate) const {
    const PoseMistake mistake = candidate.finding.mistake;
    const bool shift = isShift(mistake);
    const double min_gain = minGain(mistake);
    const std::size_t n = pieces_.size();
    if (n < 2 || (shift && std::abs(candidate.finding.shift_s) < kMinShiftS)) return false;
    if (!candidate.is_peak || candidate.gains.mean() < min_gain) return false;
    if (candidate.gains.mean(half(), n) < std::sqrt(min_gain) || !candidate.gains.agree(min_gain)) {
      return false;
    }
    const double distinction = shift ? kMinShiftDistinction : kMinDistinction;
    return mistake == PoseMistake::kPixels ||
           candidate.gains.mean() >= distinction * typical_wrong_;
  }
  /// Returns whether the poses explain the events better than wrong poses do.
  bool areExplained() const { return typical_wrong_ <= kMaxTypicalWrong && best_wrong_ <= 1; }
  bool areClear() const {  // after comparePoses
    return typical_wrong_ <= kMaxTypicalClear && best_wrong_ <= kMaxBestClear;
  }
  bool severalCameras() const { return selectedCameras(rig_, options_.cameras).size() > 1; }
  /// Returns the number of pieces on which mistakes are chosen. The others verify them.
  std::size_t half() const { return (pieces_.size() + 1) / 2; }

  const Rig& rig_;
  const FusionMapperOptions& options_;
  EventSharpness sharpness_;
  std::vector<SamplePiece> pieces_;
  std::vector<double> as_given_;  // of the first pieces; `asGiven` adds others
  std::vector<Candidate> candidates_;
  std::map<std::pair<std::int64_t, std::size_t>, double> shifted_;  // by time shift and piece
  double typical_wrong_ = 0;  // the median gain of the hypotheses: at most one is right
  double best_wrong_ = 0;
  double best_shift_gain_ = 1;
  double best_other_ = 0;  // gain of an alternative that is not the poses as they are
  bool clock_is_known_ = false;
  bool area_is_known_ = true;
};

}  // namespace

Eigen::Vector2i PixelChange::operator()(Eigen::Vector2i pixel, const CameraModel& model,
                                        std::size_t camera) const {
  if (exchange) std::swap(pixel.x(), pixel.y());
  if (mirror_x) pixel.x() = model.width - 1 - pixel.x();
  if (mirror_y) pixel.y() = model.height - 1 - pixel.y();
  if (!offset_px.empty()) pixel += offset_px[camera];
  return pixel;
}

PoseJudgement checkPoses(const Rig& rig, const std::vector<WindowSample>& samples,
                         const FusionMapperOptions& options) {
  if (samples.empty()) return {};
  return PoseCheck(rig, samples, options).run();
}

}  // namespace efm
