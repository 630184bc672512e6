// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// The stages of the mapping, for time measurements. The mapping itself never reads a clock.
enum class Stage {
  kFilter,  ///< Removal of noise from new events.
  kSweep,   ///< Packets, back-projection, votes and fusion.
  kDepth,   ///< Extraction of the depth map.
};

/// Called when a stage begins and ends, from the thread that runs the mapper.
class StageHook {
 public:
  virtual ~StageHook() = default;
  virtual void begin(Stage stage) = 0;
  virtual void end(Stage stage) = 0;
};

/// Reports a stage for the lifetime of this object.
class StageScope {
 public:
  /// @param hook may be null.
  StageScope(StageHook* hook, Stage stage) : hook_(hook), stage_(stage) {
    if (hook_ != nullptr) hook_->begin(stage_);
  }
  ~StageScope() {
    if (hook_ != nullptr) hook_->end(stage_);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageHook* hook_;
  Stage stage_;
};

}  // namespace efm
