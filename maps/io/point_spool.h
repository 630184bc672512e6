// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "maps/cloud/cloud_points.h"

namespace efm {

/// Points on the disk, part by part, for a cloud that is too large for the memory. The file has no
/// name, so nothing is left after a crash. 56 bytes per point.
class PointSpool {
 public:
  /// @param beside the file is made in the folder of this file.
  /// @throws std::runtime_error naming it if no file can be made there.
  explicit PointSpool(const std::filesystem::path& beside);

  /// @throws std::runtime_error if the disk is full.
  void add(const std::vector<CloudPoint>& part);
  /// Calls `take` for each part, in their order.
  void visit(const std::function<void(const std::vector<CloudPoint>& part)>& take);

 private:
  std::filesystem::path beside_;
  std::fstream file_;
  std::vector<std::size_t> sizes_;  // of the parts
};

}  // namespace efm
