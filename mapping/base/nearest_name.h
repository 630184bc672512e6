// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace efm {

/// The known name that was probably meant by a mistyped one: the one with the fewest letters
/// missing, added, replaced or swapped with the next one; the first of several. At most a third of
/// the longer name's letters, and at least one, may differ. Capitals, '-' and '_' do not count.
std::optional<std::string> nearestName(std::string_view typed,
                                       const std::vector<std::string>& known);

/// What an error about an unknown name says of the known ones: "did you mean rms? One of: min, rms"
/// or "expected one of min, rms". A long list is left out where one of its names is near.
std::string expectedName(std::string_view typed, const std::vector<std::string>& known);

}  // namespace efm
