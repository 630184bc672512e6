// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/options/nearest_name.h"

#include <gtest/gtest.h>

namespace efm {
namespace {

using Names = std::vector<std::string>;

TEST(NearestName, IsTheNameWithTheFewestWrongLetters) {
  const Names keys = {"min_depth_m", "max_depth_m", "num_planes", "spacing", "width"};
  const Names rules = {"min", "harmonic", "geometric", "arithmetic", "rms", "max"};
  const Names commands = {"map", "depth", "info"};
  const struct {
    const char* typed;
    const Names& known;
    const char* nearest;  ///< "": none.
  } cases[] = {
      {"num_plane", keys, "num_planes"},    // a letter is missing
      {"num_pllanes", keys, "num_planes"},  // one too many
      {"nun_planes", keys, "num_planes"},   // another one
      {"num_plnaes", keys, "num_planes"},   // two swapped
      {"Num-Planes", keys, "num_planes"},   // capitals and dashes do not count
      {"min_dept_m", keys, "min_depth_m"},  // not max_depth_m, which has three more
      {"mix", rules, "min"},                // the first of two at the same distance
      {"harmoic", rules, "harmonic"},       //
      {"mpa", commands, "map"},             // a swap is one edit: a third of three letters
      {"pam", commands, ""},                // two edits are two thirds of three letters
      {"nm_plns", keys, "num_planes"},      // three of ten letters: the limit
      {"planes", keys, ""},                 // four
      {"frobnicate", keys, ""},             //
      {"", commands, ""},                   //
      {"map", {}, ""},                      //
  };
  for (const auto& row : cases) {
    EXPECT_EQ(nearestName(row.typed, row.known).value_or(""), row.nearest) << row.typed;
  }
  EXPECT_FALSE(nearestName(std::string(100'000, 'x'), {std::string(90'000, 'x')})) << "no name";
}

TEST(NearestName, AnErrorAsksForTheNearNameAndListsTheOthersIfTheyAreFew) {
  EXPECT_EQ(expectedName("mxa", {"min", "max"}), "did you mean max? One of: min, max");
  EXPECT_EQ(expectedName("median", {"min", "max"}), "expected one of min, max");
  const Names nine = {"a1", "b22", "c333", "d4444", "e5555", "f6666", "g7777", "h8888", "i9999"};
  EXPECT_EQ(expectedName("c33", nine), "did you mean c333?");
  EXPECT_EQ(expectedName("xyz", nine),
            "expected one of a1, b22, c333, d4444, e5555, f6666, g7777, h8888, i9999");
}

}  // namespace
}  // namespace efm
