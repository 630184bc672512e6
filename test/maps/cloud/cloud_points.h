// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "maps/cloud/cloud_point.h"

namespace efm::test {

inline bool sameBits(const std::vector<CloudPoint>& a, const std::vector<CloudPoint>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const CloudPoint& p, const CloudPoint& q) {
                      return p.p_world == q.p_world && p.confidence == q.confidence &&
                             p.support == q.support && p.first_keyframe == q.first_keyframe;
                    });
}

}  // namespace efm::test
