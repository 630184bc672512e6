// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>

#include <functional>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace efm::test {

/// A field of options: values up to its limits, and values beyond them.
template <typename Options>
struct Limits {
  const char* key;
  std::function<void(Options&, double)> set;
  std::vector<double> allowed;
  std::vector<double> refused;

  template <typename Value>
  Limits(const char* name, Value Options::*field, std::vector<double> good, std::vector<double> bad)
      : key(name),
        set([field](Options& o, double value) { o.*field = static_cast<Value>(value); }),
        allowed(std::move(good)),
        refused(std::move(bad)) {}
  template <typename Set>
  Limits(const char* name, Set set_field, std::vector<double> good, std::vector<double> bad)
      : key(name), set(set_field), allowed(std::move(good)), refused(std::move(bad)) {}
};

/// Expects that `validate` takes the ones, and refuses the others in a message that begins with the
/// key and the value.
template <typename Options>
void expectLimits(const std::vector<Limits<Options>>& fields, const Options& valid = {}) {
  for (const Limits<Options>& field : fields) {
    Options options = valid;
    for (const double value : field.allowed) {
      field.set(options, value);
      EXPECT_NO_THROW(options.validate()) << field.key << " = " << value;
    }
    for (const double value : field.refused) {
      field.set(options, value);
      std::ostringstream begin;
      begin.precision(15);
      begin << field.key << " = " << value << ": must be ";
      EXPECT_THAT([&] { options.validate(); }, ::testing::ThrowsMessage<std::invalid_argument>(
                                                   ::testing::StartsWith(begin.str())));
    }
  }
}

}  // namespace efm::test
