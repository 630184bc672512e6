// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

enum class QualityWord {
  kUnknown,   ///< There is no depth, or the checks are off.
  kGood,      ///< At most a tenth of the points are wrong, as far as it can be checked.
  kDoubtful,  ///< It may be wrong, or it cannot be checked.
  kWrong,     ///< Much of it is wrong.
};

template <>
inline constexpr NamedChoice<QualityWord> kNamesOf<QualityWord>[] = {
    {QualityWord::kUnknown, "unknown"},
    {QualityWord::kGood, "good"},
    {QualityWord::kDoubtful, "doubtful"},
    {QualityWord::kWrong, "wrong"}};

/// How good a map is, by its own evidence. A depth is wrong if it is off by more than 10 %.
struct MapQuality {
  QualityWord word = QualityWord::kUnknown;
  double wrong_share = 0;  ///< Predicted fraction of the depths that are wrong.
  double depth_error = 0;  ///< Predicted median error of a depth, relative.
  /// Fraction of the depths that the keyframe before or after has, too, whether they agree or not.
  double support = 0;
  /// Fraction of these depths that agree within 10 %; std::nullopt: there are too few.
  std::optional<double> agreement;
  std::optional<double> sharpness;   ///< See PoseJudgement.
  std::vector<std::string> reasons;  ///< Why the word is not better; and what would help.
  /// Predicted fraction of the depths of each keyframe that are right.
  std::vector<float> keyframes;
  std::vector<std::size_t> much_worse;  ///< Keyframes that are much worse than the others, from 0.
  std::size_t left_out = 0;  ///< Keyframes without points in the map: `min_keyframe_quality`.
};

/// What was found about a recording before its mapping.
struct QualityFacts {
  std::vector<std::string> doubts;  ///< Reasons to doubt any map of it.
  std::string unchecked;            ///< What of the poses could not be checked, and why.
  std::string mistake;              ///< Name of a warning that makes any map wrong; or empty.
  std::optional<double> sharpness;  ///< See PoseJudgement.
  /// Fraction of the depths by the motion of one camera that agree with those by all cameras.
  std::optional<double> motion_agreement;
  double sure_depth_m = std::numeric_limits<double>::infinity();  ///< See CameraComparison.
  /// Fraction of the depths that the calibration between cameras makes wrong, beside that.
  double wrong_by_cameras = 0;
};

/// Returns the verdict in a line: the word, the numbers, the reasons.
std::string textOf(const MapQuality& quality);

/// Judges keyframes one after another by their probabilities, and by the points that consecutive
/// keyframes share.
class QualityStatistics {
  /// Points that a keyframe shares with the keyframe before it.
  struct Shared {
    std::uint32_t in_view = 0;  // points of that keyframe in the view of this one
    std::uint32_t points = 0;
    std::uint32_t agreeing = 0;
  };
  struct Keyframe {
    std::uint32_t depths = 0;
    float wrong = 0;        // mean of 1 - probability
    float depth_error = 0;  // median, by the variance
    float parallax_px = 0;  // at the median depth
    float too_far = 0;      // fraction beyond QualityFacts::sure_depth_m
    Shared before;
  };

 public:
  /// A keyframe that is judged, but not added.
  struct Judged {
    Keyframe keyframe;
    PixelCounts pixels;
    KeyframeDepthMap of;  // its depths, view and pose
  };

  /// Judges the next keyframe, and reserves the memory that `add` needs.
  Judged judge(const KeyframeDepthMap& keyframe, const QualityFacts& facts);
  void add(Judged judged) noexcept;
  /// Returns the predicted fraction of right depths of a keyframe, from it and the keyframes before
  /// and after it that were added. What is usual among all keyframes is up to a twentieth of the
  /// keyframes older: otherwise the cost of each would grow with their number.
  double rightShareOf(std::size_t keyframe);
  /// Returns the keyframes below `end` whose fraction of right depths is lower than `min_share`;
  /// each is looked at once. It is known when the next keyframe is added, or at the end.
  std::vector<std::size_t> takeBad(std::size_t end, double min_share);
  std::size_t keyframes() const { return keyframes_.size(); }

  /// Returns the quality of all keyframes. Cost: linear in their number.
  /// @param planes of the map. @param num_cameras number of cameras that took part.
  MapQuality quality(const QualityFacts& facts, const DepthPlanesOptions& planes,
                     std::size_t num_cameras) const;

 private:
  void findBadKeyframes(MapQuality& quality) const;
  double usualHits() const;
  double rightShareOf(std::size_t keyframe, double usual_hits) const;
  Shared sharedWithLast(const KeyframeDepthMap& keyframe) const;

  std::vector<Keyframe> keyframes_;
  PixelCounts pixels_;
  KeyframeDepthMap last_;  // its depths, view and pose
  double usual_hits_ = 0;  // of the first `usual_of_` keyframes
  std::size_t usual_of_ = 0;
  std::size_t looked_at_ = 0;  // by takeBad
};

}  // namespace efm
