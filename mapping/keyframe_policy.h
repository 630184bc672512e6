// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

namespace efm {

/// The events of a keyframe, [t0, t1), and the time of its reference view.
struct Window {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
  std::int64_t t_ref_ns = 0;
};

enum class KeyframePolicyKind {
  kPeriod,  ///< A window of fixed duration at every stride.
};

/// Where in its window the reference view stands.
enum class ReferenceTime {
  kMiddle,
  kEnd,  ///< For vehicles that look where they go.
};

std::string_view nameOf(KeyframePolicyKind policy);
std::string_view nameOf(ReferenceTime reference);
/// @throws std::invalid_argument naming the value and what is known.
KeyframePolicyKind keyframePolicyFromName(std::string_view name);
ReferenceTime referenceTimeFromName(std::string_view name);

struct KeyframePolicyOptions {
  KeyframePolicyKind policy = KeyframePolicyKind::kPeriod;
  double window_s = 0.2;  ///< Duration of a window, at least 1e-6.
  double stride_s = 0.2;  ///< From one window's start to the next, at least 1e-6; shorter: overlap.
  ReferenceTime reference = ReferenceTime::kMiddle;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Decides which windows of a recording become keyframes.
class KeyframePolicy {
 public:
  virtual ~KeyframePolicy() = default;
  /// The next window of a recording whose first event with a pose was at `start_ns`: windows in
  /// order of t0. Does not move on.
  /// @return nothing after the last one.
  virtual std::optional<Window> current(std::int64_t start_ns) const = 0;
  /// Moves on to the window after the current one.
  virtual void advance() = 0;
  /// Moves on past the windows that end at `t_ns` or before, at a cost that does not depend on
  /// their number. @return how many there were.
  virtual std::uint64_t advancePast(std::int64_t start_ns, std::int64_t t_ns) = 0;
};

/// @throws std::invalid_argument where the options are not valid.
std::unique_ptr<KeyframePolicy> makeKeyframePolicy(const KeyframePolicyOptions& options);
/// One window and no other, wherever the recording starts.
std::unique_ptr<KeyframePolicy> makeSingleWindowPolicy(const Window& window);

}  // namespace efm
