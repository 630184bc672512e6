// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/keyframe_consistency.h"

#include "mapping/base/named_choice.h"

namespace efm {
namespace {

constexpr NamedChoice<Consistency> kConsistencies[] = {
    {Consistency::kNone, "none"},
    {Consistency::kSupport, "support"},
    {Consistency::kVisibility, "visibility"},
};

}  // namespace

std::string_view nameOf(Consistency consistency) { return nameIn(kConsistencies, consistency); }

Consistency consistencyFromName(std::string_view name) { return valueIn(kConsistencies, name); }

void ConsistencyOptions::validate() const {
  requireOption(consistency_tolerance >= 0.001 && consistency_tolerance <= 1,
                "consistency_tolerance", consistency_tolerance, "from 0.001 to 1");
  requireOption(consistency_cell_deg >= 0.01 && consistency_cell_deg <= 10, "consistency_cell_deg",
                consistency_cell_deg, "from 0.01 to 10 (degrees)");
  requireOption(max_contradictions >= 0 && max_contradictions <= 16, "max_contradictions",
                max_contradictions, "from 0 to 16");
}

}  // namespace efm
