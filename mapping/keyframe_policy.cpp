// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframe_policy.h"

#include "mapping/named_choice.h"
#include "mapping/option_check.h"
#include "mapping/timestamp.h"

namespace efm {
namespace {

constexpr NamedChoice<KeyframePolicyKind> kPolicies[] = {{KeyframePolicyKind::kPeriod, "period"}};
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

  std::optional<Window> current(std::int64_t start_ns) const override {
    const std::int64_t t0_ns = start_ns + index_ * stride_ns_;
    const std::int64_t t1_ns = t0_ns + window_ns_;
    const bool middle = reference_ == ReferenceTime::kMiddle;
    return Window{t0_ns, t1_ns, middle ? t0_ns + window_ns_ / 2 : t1_ns};
  }
  void advance() override { ++index_; }
  std::uint64_t advancePast(std::int64_t start_ns, std::int64_t t_ns) override {
    const std::int64_t since_first_end_ns = t_ns - start_ns - window_ns_;
    if (since_first_end_ns < 0) return 0;
    const std::int64_t next = since_first_end_ns / stride_ns_ + 1;
    if (next <= index_) return 0;
    const auto passed = static_cast<std::uint64_t>(next - index_);
    index_ = next;
    return passed;
  }

 private:
  std::int64_t window_ns_;
  std::int64_t stride_ns_;
  ReferenceTime reference_;
  std::int64_t index_ = 0;
};

class SingleWindowPolicy : public KeyframePolicy {
 public:
  explicit SingleWindowPolicy(const Window& window) : window_(window) {}

  std::optional<Window> current(std::int64_t) const override { return window_; }
  void advance() override { window_.reset(); }
  std::uint64_t advancePast(std::int64_t, std::int64_t t_ns) override {
    if (!window_ || window_->t1_ns > t_ns) return 0;
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

void KeyframePolicyOptions::validate() const {
  requireOption(window_s >= 1e-6 && window_s <= 1e6, "window_s", window_s, "1e-6 to 1e6");
  requireOption(stride_s >= 1e-6 && stride_s <= 1e6, "stride_s", stride_s, "1e-6 to 1e6");
}

std::unique_ptr<KeyframePolicy> makeKeyframePolicy(const KeyframePolicyOptions& options) {
  options.validate();
  switch (options.policy) {
    case KeyframePolicyKind::kPeriod:
      return std::make_unique<PeriodPolicy>(options);
  }
  return nullptr;
}

std::unique_ptr<KeyframePolicy> makeSingleWindowPolicy(const Window& window) {
  return std::make_unique<SingleWindowPolicy>(window);
}

}  // namespace efm
