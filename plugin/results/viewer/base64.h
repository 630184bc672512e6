// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace efm {

/// RFC 4648, with padding. Parts of a longer content can be joined where all but the last have a
/// multiple of 3 bytes.
std::string base64(const std::vector<std::uint8_t>& bytes);

}  // namespace efm
