// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/timestamp.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "mapping/base/text.h"

namespace efm {
namespace {

constexpr int kNanosecondDigits = 9;

bool isDigit(char c) { return c >= '0' && c <= '9'; }

/// Appends a decimal digit. @return false if the value would not fit 64 bits.
bool appendDigit(std::int64_t& value, int digit) {
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  if (value > (kMax - digit) / 10) return false;
  value = value * 10 + digit;
  return true;
}

/// A decimal number: digits before and after the point, and the power of ten that multiplies it.
struct DecimalDigits {
  std::string_view integer;
  std::string_view fraction;
  int exponent = 0;

  int digitAt(std::int64_t index) const {
    const auto integer_size = static_cast<std::int64_t>(integer.size());
    if (index < integer_size) return integer[static_cast<std::size_t>(index)] - '0';
    const auto in_fraction = static_cast<std::size_t>(index - integer_size);
    return in_fraction < fraction.size() ? fraction[in_fraction] - '0' : 0;
  }
  std::int64_t count() const { return static_cast<std::int64_t>(integer.size() + fraction.size()); }
};

std::string_view takeDigits(std::string_view& text) {
  std::size_t length = 0;
  while (length < text.size() && isDigit(text[length])) ++length;
  const std::string_view digits = text.substr(0, length);
  text.remove_prefix(length);
  return digits;
}

/// Splits unsigned decimal text. @return std::nullopt if the whole text is not a number.
std::optional<DecimalDigits> splitDecimal(std::string_view text) {
  DecimalDigits digits;
  digits.integer = takeDigits(text);
  if (!text.empty() && text.front() == '.') {
    text.remove_prefix(1);
    digits.fraction = takeDigits(text);
  }
  if (digits.count() == 0) return std::nullopt;
  if (!text.empty() && (text.front() == 'e' || text.front() == 'E')) {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '+') {
      text.remove_prefix(1);
      if (!text.empty() && text.front() == '-') return std::nullopt;  // parseNumber accepts a minus
    }
    const std::optional<int> exponent = parseNumber<int>(text);
    if (!exponent || *exponent < -1000 || *exponent > 1000) return std::nullopt;
    digits.exponent = *exponent;
    text = {};
  }
  return text.empty() ? std::optional(digits) : std::nullopt;
}

}  // namespace

std::optional<std::int64_t> parseSeconds(std::string_view text) { return parseTimeIn(text, 0); }

std::optional<std::int64_t> parseTimeIn(std::string_view text, int exponent) {
  bool negative = false;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    negative = text.front() == '-';
    text.remove_prefix(1);
  }
  std::optional<DecimalDigits> digits = splitDecimal(text);
  if (!digits) return std::nullopt;
  digits->exponent += exponent;

  // Digits up to this index are whole nanoseconds; the next digit rounds.
  const std::int64_t whole =
      static_cast<std::int64_t>(digits->integer.size()) + digits->exponent + kNanosecondDigits;
  std::int64_t t_ns = 0;
  for (std::int64_t i = 0; i < whole; ++i) {
    if (t_ns == 0 && i >= digits->count()) break;  // zero, with any exponent
    if (!appendDigit(t_ns, digits->digitAt(i))) return std::nullopt;
  }
  if (whole >= 0 && whole < digits->count() && digits->digitAt(whole) >= 5) {
    if (t_ns == std::numeric_limits<std::int64_t>::max()) return std::nullopt;
    ++t_ns;
  }
  return negative ? -t_ns : t_ns;
}

std::string formatSeconds(std::int64_t t_ns) {
  const bool negative = t_ns < 0;
  // The magnitude of the most negative value does not fit the signed type.
  const std::uint64_t magnitude =
      negative ? ~static_cast<std::uint64_t>(t_ns) + 1 : static_cast<std::uint64_t>(t_ns);
  constexpr std::uint64_t kBillion = kNanosecondsPerSecond;
  char text[40];
  const int length = std::snprintf(text, sizeof text, "%s%llu.%09llu", negative ? "-" : "",
                                   static_cast<unsigned long long>(magnitude / kBillion),
                                   static_cast<unsigned long long>(magnitude % kBillion));
  return std::string(text, static_cast<std::size_t>(length));
}

std::int64_t durationFromSeconds(double duration_s) {
  const double duration_ns = std::round(duration_s * 1e9);
  if (!(std::abs(duration_ns) < 9.2e18)) {
    throw std::invalid_argument("a duration of " + std::to_string(duration_s) +
                                " s: must be finite and below 292 years");
  }
  return static_cast<std::int64_t>(duration_ns);
}

}  // namespace efm
