// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_policy.h"

#include <algorithm>
#include <utility>

#include "mapping/base/named_choice.h"
#include "mapping/base/option_check.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/keyframes/baseline_policy.h"

namespace efm {
namespace {

constexpr NamedChoice<KeyframePolicyKind> kPolicies[] = {
    {KeyframePolicyKind::kPeriod, "period"},
    {KeyframePolicyKind::kEvents, "events"},
    {KeyframePolicyKind::kBaseline, "baseline"},
};
constexpr NamedChoice<ReferenceTime> kReferences[] = {
    {ReferenceTime::kMiddle, "middle"},
    {ReferenceTime::kEnd, "end"},
};

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
    const std::int64_t new_ns = t0_ns - (next_ns - stride_ns_);  // no other window has them
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
  std::uint64_t giveUpBefore(const RecordingProgress& recording, std::int64_t t_ns) override {
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
  std::uint64_t advancePast(const RecordingProgress&, std::int64_t) override { return 0; }
  std::uint64_t giveUpBefore(const RecordingProgress& recording, std::int64_t t_ns) override {
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
  /// The events that the last window given up still lacks: their loss is counted with it.
  std::int64_t counted_events_ = 0;
};

class SingleWindowPolicy : public KeyframePolicy {
 public:
  explicit SingleWindowPolicy(const Window& window) : window_(window) {}

  std::optional<Window> current(const RecordingProgress&) override { return window_; }
  std::optional<Window> last(const RecordingProgress&, std::int64_t) const override {
    return std::nullopt;
  }
  std::int64_t earliestLast(const RecordingProgress& recording) const override {
    return earliestStart(recording);
  }
  std::int64_t earliestStart(const RecordingProgress&) const override {
    return window_ ? window_->t0_ns : kMaxTimeNs;
  }
  std::int64_t earliestReference(const RecordingProgress&) const override {
    return window_ ? std::min(window_->t0_ns, window_->t_ref_ns) : kMaxTimeNs;
  }
  void advance(const Window&, const KeyframeDepthMap*) override { window_.reset(); }
  std::uint64_t advancePast(const RecordingProgress&, std::int64_t t_ns) override {
    if (!window_ || window_->t1_ns > t_ns) return 0;
    window_.reset();
    return 1;
  }
  std::uint64_t giveUpBefore(const RecordingProgress&, std::int64_t t_ns) override {
    if (!window_ || window_->t0_ns >= t_ns) return 0;
    window_.reset();
    return 1;
  }

 private:
  std::optional<Window> window_;
};

}  // namespace

std::string_view nameOf(KeyframePolicyKind policy) { return nameIn(kPolicies, policy); }
std::string_view nameOf(ReferenceTime reference) { return nameIn(kReferences, reference); }
KeyframePolicyKind keyframePolicyFromName(std::string_view name) {
  return valueIn(kPolicies, name);
}
ReferenceTime referenceTimeFromName(std::string_view name) { return valueIn(kReferences, name); }

Window windowOf(std::int64_t t0_ns, std::int64_t t1_ns, ReferenceTime reference) {
  const bool middle = reference == ReferenceTime::kMiddle;
  return {t0_ns, t1_ns, middle ? t0_ns + (t1_ns - t0_ns) / 2 : t1_ns};
}

void KeyframePolicyOptions::validate() const {
  requireOption(window_s >= 1e-6 && window_s <= 1e6, "window_s", window_s, "1e-6 to 1e6");
  requireOption(stride_s >= 1e-6 && stride_s <= 1e6, "stride_s", stride_s, "1e-6 to 1e6");
  requireOption(policy != KeyframePolicyKind::kBaseline || stride_s <= window_s, "stride_s",
                stride_s, "at most window_s with the policy 'baseline'");
  requireOption(window_events >= 1, "window_events", window_events, "1 or above");
  requireOption(min_baseline_ratio > 0 && min_baseline_ratio <= 10, "min_baseline_ratio",
                min_baseline_ratio, "above 0, at most 10");
  requireOption(min_visible_fraction >= 0 && min_visible_fraction <= 1, "min_visible_fraction",
                min_visible_fraction, "0 to 1");
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

std::unique_ptr<KeyframePolicy> makeSingleWindowPolicy(const Window& window) {
  return std::make_unique<SingleWindowPolicy>(window);
}

}  // namespace efm
