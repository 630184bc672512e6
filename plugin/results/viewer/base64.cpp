// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/viewer/base64.h"

#include <cstddef>

namespace efm {

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto at = [&](std::size_t k) { return k < bytes.size() ? bytes[k] : std::uint8_t{0}; };
    const std::uint32_t bits =
        std::uint32_t{bytes[i]} << 16U | std::uint32_t{at(i + 1)} << 8U | at(i + 2);
    text += kDigits[bits >> 18U];
    text += kDigits[bits >> 12U & 63U];
    text += i + 1 < bytes.size() ? kDigits[bits >> 6U & 63U] : '=';
    text += i + 2 < bytes.size() ? kDigits[bits & 63U] : '=';
  }
  return text;
}

}  // namespace efm
