// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// The steps of a keyframe, for whoever measures them: the mapping itself never looks at a clock.
enum class Stage {
  kSweep,  ///< Packets, back-projection, votes and fusion.
  kDepth,  ///< Extraction of the depth map.
};

/// Told when a step begins and ends, from the thread that runs the mapper.
class StageHook {
 public:
  virtual ~StageHook() = default;
  virtual void begin(Stage stage) = 0;
  virtual void end(Stage stage) = 0;
};

}  // namespace efm
