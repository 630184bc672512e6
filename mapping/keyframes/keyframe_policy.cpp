// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_policy.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Window k starts at the recording's start + k strides.
class PeriodPolicy : public KeyframePolicy {
 public:
  explicit PeriodPolicy(const KeyframePolicyOptions& options)
      : window_ns_(durationFromSeconds(options.window_s)),
        stride_ns_(durationFromSeconds(options.stride_s)),
        reference_(options.reference) {}

  std::optional<Window> current(const RecordingProgress& recording) override {
    const std::int64_t t0_ns = earliestStart(recording);
    const Window window = windowOf(t0_ns, t0_ns + window_ns_, reference_);
    if (recording.reachedNs() < window.t1_ns) return std::nullopt;
    return window;
  }
  std::optional<Window> last(const RecordingProgress& recording,
                             std::int64_t end_ns) const override {
    const std::int64_t next_ns = earliestStart(recording);
    const std::int64_t t0_ns = end_ns - window_ns_;
    const std::int64_t new_ns = t0_ns - (next_ns - stride_ns_);  // in no other window
    const bool adds_little = index_ > 0 && new_ns < std::min(stride_ns_, window_ns_) * kLeastAdded;
    if (end_ns <= next_ns || adds_little || t0_ns < recording.startNs()) return std::nullopt;
    return windowOf(t0_ns, end_ns, reference_);
  }
  std::int64_t earliestLast(const RecordingProgress& recording) const override {
    return earliestStart(recording) - std::min(stride_ns_, window_ns_);
  }
  std::int64_t earliestStart(const RecordingProgress& recording) const override {
    return recording.startNs() + index_ * stride_ns_;
  }
  void advance(const Window&, const KeyframeDepthMap*) override { ++index_; }
  std::uint64_t advancePast(const RecordingProgress& recording, std::int64_t t_ns) override {
    const std::int64_t since_first_end_ns = t_ns - recording.startNs() - window_ns_;
    if (since_first_end_ns < 0) return 0;
    return moveTo(since_first_end_ns / stride_ns_ + 1);
  }
  std::uint64_t dropWindowsBefore(const RecordingProgress& recording, std::int64_t t_ns) override {
    const std::int64_t since_start_ns = t_ns - recording.startNs();
    return since_start_ns <= 0 ? 0 : moveTo((since_start_ns - 1) / stride_ns_ + 1);
  }

 private:
  std::uint64_t moveTo(std::int64_t next) {
    if (next <= index_) return 0;
    return static_cast<std::uint64_t>(next - std::exchange(index_, next));
  }

  std::int64_t window_ns_;
  std::int64_t stride_ns_;
  ReferenceTime reference_;
  std::int64_t index_ = 0;
};

/// A window starts with the first event after the previous window, and ends right after its last
/// event: further events of the same time belong to it too.
class EventsPolicy : public KeyframePolicy {
 public:
  explicit EventsPolicy(const KeyframePolicyOptions& options)
      : window_events_(options.window_events), reference_(options.reference) {}

  std::optional<Window> current(const RecordingProgress& recording) override {
    const std::int64_t from_ns = earliestStart(recording);
    const auto last_ns = recording.timeOfEvent(from_ns, window_events_);
    if (!last_ns) return std::nullopt;
    return windowOf(*recording.timeOfEvent(from_ns, 1), *last_ns + 1, reference_);
  }
  std::optional<Window> last(const RecordingProgress& recording,
                             std::int64_t end_ns) const override {
    const std::int64_t new_events = recording.eventsIn(earliestStart(recording), end_ns);
    if (new_events == 0 || new_events < window_events_ * kLeastAdded) return std::nullopt;
    const std::int64_t from_ns = earliestLast(recording);
    const std::int64_t excess = recording.eventsIn(from_ns, end_ns) - window_events_;
    if (excess < 0) return std::nullopt;
    return windowOf(*recording.timeOfEvent(from_ns, excess + 1), end_ns, reference_);
  }
  std::int64_t earliestLast(const RecordingProgress& recording) const override {
    return before_ns_.value_or(recording.startNs());
  }
  std::int64_t earliestStart(const RecordingProgress& recording) const override {
    return next_ns_.value_or(recording.startNs());
  }
  void advance(const Window& window, const KeyframeDepthMap*) override {
    before_ns_ = window.t0_ns;
    next_ns_ = window.t1_ns;
    counted_events_ = 0;
  }
  std::uint64_t dropWindowsBefore(const RecordingProgress& recording, std::int64_t t_ns) override {
    const std::int64_t from_ns = earliestStart(recording);
    if (t_ns <= from_ns) return 0;
    counted_events_ -= recording.eventsIn(from_ns, t_ns);
    before_ns_ = next_ns_ = t_ns;
    if (counted_events_ >= 0) return 0;
    const std::int64_t windows = (-counted_events_ - 1) / window_events_ + 1;
    counted_events_ += windows * window_events_;
    return static_cast<std::uint64_t>(windows);
  }

 private:
  std::int64_t window_events_;
  ReferenceTime reference_;
  std::optional<std::int64_t> before_ns_;  // start of the window before
  std::optional<std::int64_t> next_ns_;
  /// Number of events that the last dropped window still lacks: their loss counts with that window.
  std::int64_t counted_events_ = 0;
};

constexpr int kGridSide = 10;

/// Returns a grid of points over the image of a view, all at one depth.
std::vector<Eigen::Vector3d> pointsAcross(const ReferenceView& view, const Rigid3& T_world_ref,
                                          double depth_m) {
  std::vector<Eigen::Vector3d> points;
  for (int j = 0; j < kGridSide; ++j) {
    for (int i = 0; i < kGridSide; ++i) {
      const double x = (i + 0.5) / kGridSide * (view.width - 1);
      const double y = (j + 0.5) / kGridSide * (view.height - 1);
      points.push_back(T_world_ref * view.pointAt(x, y, depth_m));
    }
  }
  return points;
}

double visibleFraction(const std::vector<Eigen::Vector3d>& points_world, const Rigid3& T_world_ref,
                       const ReferenceView& view) {
  const Rigid3 T_ref_world = T_world_ref.inverse();
  const auto in_view = [&](const Eigen::Vector3d& p_world) {
    const Eigen::Vector3d p_ref = T_ref_world * p_world;
    if (!(p_ref.z() > 0)) return false;
    const Eigen::Vector2d pixel = view.project(p_ref);
    return pixel.x() >= 0 && pixel.x() <= view.width - 1 && pixel.y() >= 0 &&
           pixel.y() <= view.height - 1;
  };
  const auto count = std::count_if(points_world.begin(), points_world.end(), in_view);
  return static_cast<double>(count) / static_cast<double>(points_world.size());
}

/// A window starts with the first event after the previous window and grows, stride by stride,
/// until one of two conditions holds:
/// - the reference camera has moved by a fraction of the scene's mean depth since the window's
///   start;
/// - too few points of the last keyframe are in view. Without such points, a grid of points at the
///   mean depth replaces them.
/// So a keyframe has enough parallax at any speed (Rebecq et al., IJCV 2018, Sec. 7).
///
/// If the longest window meets neither condition, its start moves on by a stride: the events of a
/// camera at rest are in no window.
class BaselinePolicy : public KeyframePolicy {
 public:
  BaselinePolicy(const KeyframePolicyOptions& options, double depth_guess_m)
      : options_(options),
        window_ns_(durationFromSeconds(options.window_s)),
        stride_ns_(durationFromSeconds(options.stride_s)),
        mean_depth_m_(depth_guess_m),
        duration_ns_(stride_ns_) {}

  std::optional<Window> current(const RecordingProgress& recording) override {
    while (true) {
      const auto t0_ns = recording.timeOfEvent(earliestStart(recording), 1);
      if (!t0_ns) return std::nullopt;
      const auto T_world_ref0 = recording.viewPoseAt(*t0_ns);
      for (; T_world_ref0 && duration_ns_ <= window_ns_; duration_ns_ += stride_ns_) {
        const std::int64_t t1_ns = *t0_ns + duration_ns_;
        if (t1_ns > recording.completeNs()) return std::nullopt;
        const auto T_world_ref1 = recording.viewPoseAt(t1_ns);
        if (T_world_ref1 && isEnough(*T_world_ref0, *T_world_ref1, recording.view())) {
          return windowOf(*t0_ns, t1_ns, options_.reference);
        }
      }
      startAt(*t0_ns + stride_ns_);
    }
  }
  /// The window grows from the end back, stride by stride.
  std::optional<Window> last(const RecordingProgress& recording,
                             std::int64_t end_ns) const override {
    const auto first_ns = recording.timeOfEvent(earliestStart(recording), 1);
    if (!first_ns || *first_ns >= end_ns) return std::nullopt;
    const auto T_world_ref1 = recording.viewPoseAt(end_ns - 1);  // the pose of the last event
    std::int64_t t0_ns = std::min(*first_ns, end_ns - stride_ns_);
    for (; t0_ns >= recording.startNs() && end_ns - t0_ns <= window_ns_; t0_ns -= stride_ns_) {
      const auto T_world_ref0 = recording.viewPoseAt(t0_ns);
      if (T_world_ref0 && T_world_ref1 &&
          isEnough(*T_world_ref0, *T_world_ref1, recording.view())) {
        if (end_ns - *first_ns < (end_ns - t0_ns) * kLeastAdded) break;
        return windowOf(t0_ns, end_ns, options_.reference);
      }
    }
    return std::nullopt;
  }
  std::int64_t earliestLast(const RecordingProgress& recording) const override {
    return earliestStart(recording) - window_ns_;
  }
  std::int64_t earliestStart(const RecordingProgress& recording) const override {
    return next_ns_.value_or(recording.startNs());
  }
  void advance(const Window& window, const KeyframeDepthMap* keyframe) override {
    constexpr std::size_t kMaxSeenPoints = 500;  // about; spread over the image
    startAt(window.t1_ns);
    counted_until_ns_ = kMinTimeNs;
    if (keyframe == nullptr) return;
    // Cleared even if the keyframe has no points: points of an older keyframe, out of view by now,
    // would end every window after one stride, too early for new points.
    seen_world_.clear();
    std::vector<cv::Point> pixels;
    cv::findNonZero(keyframe->map.depth > 0, pixels);
    const std::size_t every = pixels.size() / kMaxSeenPoints + 1;
    double mean_depth_m = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double depth_m = keyframe->map.depth(pixels[i]);
      mean_depth_m += depth_m / static_cast<double>(pixels.size());
      if (i % every != 0) continue;
      seen_world_.push_back(keyframe->T_world_ref *
                            keyframe->view.pointAt(pixels[i].x, pixels[i].y, depth_m));
    }
    if (!pixels.empty()) mean_depth_m_ = mean_depth_m;
  }
  std::uint64_t dropWindowsBefore(const RecordingProgress& recording, std::int64_t t_ns) override {
    const std::int64_t from_ns = earliestStart(recording);
    if (t_ns <= from_ns) return 0;
    startAt(t_ns);
    const std::int64_t uncounted_ns = std::max(from_ns, counted_until_ns_);
    if (t_ns <= uncounted_ns || recording.eventsIn(from_ns, t_ns) == 0) return 0;
    // The windows that would have come are unknown: the longest windows are assumed.
    const std::int64_t windows = (t_ns - uncounted_ns - 1) / window_ns_ + 1;
    counted_until_ns_ = uncounted_ns + windows * window_ns_;
    return static_cast<std::uint64_t>(windows);
  }

 private:
  bool isEnough(const Rigid3& T_world_ref0, const Rigid3& T_world_ref1,
                const ReferenceView& view) const {
    const double baseline_m = (T_world_ref1.translation - T_world_ref0.translation).norm();
    if (baseline_m >= options_.min_baseline_ratio * mean_depth_m_) return true;
    const double fraction =
        seen_world_.empty()
            ? visibleFraction(pointsAcross(view, T_world_ref0, mean_depth_m_), T_world_ref1, view)
            : visibleFraction(seen_world_, T_world_ref1, view);
    return fraction < options_.min_visible_fraction;
  }
  void startAt(std::int64_t t_ns) {
    next_ns_ = t_ns;
    duration_ns_ = stride_ns_;
  }

  KeyframePolicyOptions options_;
  std::int64_t window_ns_;
  std::int64_t stride_ns_;
  double mean_depth_m_;
  std::vector<Eigen::Vector3d> seen_world_;     // points of the last keyframe
  std::optional<std::int64_t> next_ns_;         // earliest start of the next window
  std::int64_t duration_ns_;                    // the next candidate
  std::int64_t counted_until_ns_ = kMinTimeNs;  // by the dropped windows
};

class GivenWindowsPolicy : public KeyframePolicy {
 public:
  explicit GivenWindowsPolicy(std::vector<Window> windows) : windows_(std::move(windows)) {}

  std::optional<Window> current(const RecordingProgress&) override {
    return hasNext() ? std::optional(windows_[next_]) : std::nullopt;
  }
  std::optional<Window> last(const RecordingProgress&, std::int64_t) const override {
    return std::nullopt;
  }
  std::int64_t earliestStart(const RecordingProgress&) const override {
    return hasNext() ? windows_[next_].t0_ns : kMaxTimeNs;
  }
  std::int64_t earliestReference(const RecordingProgress&) const override {
    return hasNext() ? std::min(windows_[next_].t0_ns, windows_[next_].t_ref_ns) : kMaxTimeNs;
  }
  void advance(const Window&, const KeyframeDepthMap*) override { ++next_; }
  std::uint64_t advancePast(const RecordingProgress&, std::int64_t t_ns) override {
    return skipWhile([&](const Window& window) { return window.t1_ns <= t_ns; });
  }
  std::uint64_t dropWindowsBefore(const RecordingProgress&, std::int64_t t_ns) override {
    return skipWhile([&](const Window& window) { return window.t0_ns < t_ns; });
  }

 private:
  bool hasNext() const { return next_ < windows_.size(); }
  template <typename Condition>
  std::uint64_t skipWhile(const Condition& condition) {
    const std::size_t before = next_;
    while (hasNext() && condition(windows_[next_])) ++next_;
    return next_ - before;
  }

  std::vector<Window> windows_;
  std::size_t next_ = 0;
};

}  // namespace

Window windowOf(std::int64_t t0_ns, std::int64_t t1_ns, ReferenceTime reference) {
  const bool middle = reference == ReferenceTime::kMiddle;
  return {t0_ns, t1_ns, middle ? t0_ns + (t1_ns - t0_ns) / 2 : t1_ns};
}

void KeyframePolicyOptions::validate() const {
  requireFields(*this);
  requireOption(policy != KeyframePolicyKind::kBaseline || stride_s <= window_s, "stride_s",
                stride_s, "at most window_s with the policy 'baseline'", {"policy", "window_s"});
}

std::unique_ptr<KeyframePolicy> makeKeyframePolicy(const KeyframePolicyOptions& options,
                                                   double depth_guess_m) {
  options.validate();
  switch (options.policy) {
    case KeyframePolicyKind::kPeriod:
      return std::make_unique<PeriodPolicy>(options);
    case KeyframePolicyKind::kEvents:
      return std::make_unique<EventsPolicy>(options);
    case KeyframePolicyKind::kBaseline:
      return std::make_unique<BaselinePolicy>(options, depth_guess_m);
  }
  return nullptr;
}

std::unique_ptr<KeyframePolicy> makeGivenWindowsPolicy(std::vector<Window> windows) {
  return std::make_unique<GivenWindowsPolicy>(std::move(windows));
}

}  // namespace efm
