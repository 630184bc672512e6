// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/options/quoted_text.h"

#include <gtest/gtest.h>

namespace efm::quoted_text_test {
namespace {

TEST(QuotedText, PlainTextStaysAsItIs) {
  EXPECT_EQ(printable("1.5e-3 m"), "1.5e-3 m");
  EXPECT_EQ(inQuotes("1.5e-3 m"), "'1.5e-3 m'");
  EXPECT_EQ(inQuotes(""), "''");
}

TEST(QuotedText, ControlCharactersAreWrittenInHexadecimal) {
  EXPECT_EQ(inQuotes("a\x1b[2Jb\r\n\t\x7f"), R"('a\x1b[2Jb\x0d\x0a\x09\x7f')");
  EXPECT_EQ(inQuotes("\xc2\x9b"), R"('\xc2\x9b')") << "the control characters beyond ASCII";
  EXPECT_EQ(inQuotes(std::string_view("\0", 1)), R"('\x00')");
}

TEST(QuotedText, LongTextIsCutAfterFortyCharacters) {
  EXPECT_EQ(inQuotes(std::string(40, 'a')), "'" + std::string(40, 'a') + "'");
  EXPECT_EQ(inQuotes(std::string(41, 'a')), "'" + std::string(40, 'a') + "…'");
  EXPECT_LT(inQuotes(std::string(1 << 20, '\x1b')).size(), 200U);
}

}  // namespace
}  // namespace efm::quoted_text_test
