// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/npy_header.h"

#include <gmock/gmock.h>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Returns the header of a file with this dictionary.
std::string npy(const std::string& dictionary, char version = 1) {
  std::string length(version == 1 ? 2 : 4, '\0');
  length[0] = static_cast<char>(dictionary.size() % 256);
  length[1] = static_cast<char>(dictionary.size() / 256);
  return std::string("\x93NUMPY") + version + '\0' + length + dictionary;
}

std::string dictionary(const std::string& descr, const std::string& shape = "(3,)") {
  return "{'descr': " + descr + ", 'fortran_order': False, 'shape': " + shape + ", }\n";
}

std::string errorOfHeader(const std::string& bytes) {
  return messageOf([&] { parseNpyHeader(bytes); });
}

TEST(NpyHeader, HasTheTypeOfItsNumbers) {
  struct Case {
    std::string descr;
    NumberType type;
    bool big_endian;
    std::size_t bytes;
  };
  const Case cases[] = {
      {"|i1", NumberType::kInt8, false, 1},   {">u1", NumberType::kUint8, true, 1},
      {"|b1", NumberType::kUint8, false, 1},  {"<i2", NumberType::kInt16, false, 2},
      {">u2", NumberType::kUint16, true, 2},  {"<i4", NumberType::kInt32, false, 4},
      {"<u4", NumberType::kUint32, false, 4}, {">i8", NumberType::kInt64, true, 8},
      {"<u8", NumberType::kUint64, false, 8}, {"<f4", NumberType::kFloat32, false, 4},
      {">f8", NumberType::kFloat64, true, 8},
  };
  for (const Case& of : cases) {
    const NpyHeader header = parseNpyHeader(npy(dictionary("'" + of.descr + "'", "(7, 3)")));
    EXPECT_EQ(header.descr, of.descr);
    EXPECT_EQ(header.type, of.type) << of.descr;
    EXPECT_EQ(header.big_endian, of.big_endian) << of.descr;
    EXPECT_EQ(header.element_bytes, of.bytes) << of.descr;
    EXPECT_EQ(header.bytes(), 21 * of.bytes) << of.descr;
    EXPECT_FALSE(header.structured || header.fortran_order);
    EXPECT_NO_THROW(requirePlainRows(header));
  }
}

TEST(NpyHeader, HasTheNumbersOfAStructureAndWhereTheyStand) {
  const NpyHeader header = parseNpyHeader(npy(dictionary(
      "[('t', '<f8'), ('xy', '<u2', (2, 3)), ('', '|V3'), (('a title', 'p'), '>i2'), "
      "(\"in\", [('a', '<f4'), ('b', '|S5')], 2), ('name', '<U2'), ('one', '|u1', (1,)), "
      "('when', '<M8[us]'), ('q', '|b1')]")));
  EXPECT_TRUE(header.structured);
  std::vector<std::string> fields;
  for (const NpyField& field : header.fields) {
    fields.push_back(field.name + " " + std::to_string(field.offset) +
                     (field.big_endian ? " big" : ""));
  }
  // Bytes: 8 (t), 12 (xy), 3 (padding), 2 (p), 2 * 9 (in), 8 (name), 1 (one), 8 (when), 1 (q).
  EXPECT_THAT(fields, ElementsAre("t 0", "p 23 big", "one 51", "q 60"));
  EXPECT_EQ(header.fields[0].type, NumberType::kFloat64);
  EXPECT_EQ(header.fields[1].type, NumberType::kInt16);
  EXPECT_EQ(header.element_bytes, 61U);
  EXPECT_THAT(messageOf([&] { requirePlainRows(header); }), HasSubstr("a structured array"));
}

TEST(NpyHeader, HasItsShapeAndTheBeginOfTheDataInEachVersion) {
  struct Case {
    std::string shape;
    std::vector<std::uint64_t> sides;
    std::uint64_t count;
  };
  constexpr std::uint64_t kMost = std::uint64_t{1} << 53U;
  for (const Case& of : {Case{"()", {}, 1},
                         {"(5,)", {5}, 5},
                         {"(2, 3)", {2, 3}, 6},
                         {"(0, 7)", {0, 7}, 0},
                         {"(9007199254740992,)", {kMost}, kMost}}) {
    for (const char version : {1, 2, 3}) {
      // Blanks are anywhere, and the length does not fit into one byte.
      const std::string text = "{'shape' : " + of.shape + ",'fortran_order':True, 'descr':'<f4'}" +
                               std::string(300, ' ') + "\n";
      const NpyHeader header = parseNpyHeader(npy(text, version) + "data");
      EXPECT_EQ(header.shape, of.sides);
      EXPECT_EQ(header.count(), of.count);
      EXPECT_EQ(header.data_begin, (version == 1 ? 10U : 12U) + text.size());
      EXPECT_TRUE(header.fortran_order);
      EXPECT_EQ(messageOf([&] { requirePlainRows(header); }) == "no error", of.sides.size() < 2);
    }
  }
}

TEST(NpyHeader, WrongOnesAreErrorsThatSayWhatIsWrong) {
  const auto list = [](const std::string& fields) { return npy(dictionary(fields)); };
  const auto nested = [&](int depth) {
    std::string descr = "'|u1'";
    for (int i = 0; i < depth; ++i) descr = "[('a', " + descr + ")]";
    return list(descr);
  };
  const auto shaped = [](const std::string& descr, const std::string& shape) {
    return npy(dictionary(descr, shape));
  };
  const std::string whole = npy(dictionary("'<f4'"));
  EXPECT_EQ(errorOfHeader(nested(9)), "no error");
  EXPECT_EQ(errorOfHeader(list("[('a', '|V65535'), ('b', '|u1')]")), "no error");
  const std::pair<std::string, std::string> cases[] = {
      {"\x93NUMPX" + whole.substr(6), "does not begin as a NumPy array"},
      {whole.substr(0, 9), "the file ends inside it"},
      {npy(dictionary("'<f4'"), 2).substr(0, 11), "the file ends inside it"},
      {whole.substr(0, whole.size() - 1), "the file ends inside it"},
      {npy(""), "there is no 'descr'"},
      {npy("", 2), "there is no 'descr'"},
      {npy("{}", 0), "version 0: expected 1, 2 or 3"},
      {npy("{}", 4), "version 4: expected 1, 2 or 3"},
      {npy("{'descr': '<f4'}"), "there is no 'fortran_order'"},
      {npy("{'shape': (3,), 'fortran_order': False}"), "there is no 'descr'"},
      {list("'<f2'"), "descr = ''<f2'': expected numbers"},
      {list("'|f4'"), "expected numbers"},
      {list("'=f4'"), "expected numbers"},
      {list("'<f4"), "expected numbers"},
      {list("\"<f4\""), "expected numbers"},
      {list("'|O'"), ", Python objects: expected numbers"},
      {list("[('a', '|O8')]"), "descr = ''|O8'', Python objects"},
      {list("[]"), "expected a list of fields"},
      {list("[('a', '|V0')]"), "expected a list of fields"},
      {list("[('a' '<f4')]"), "expected a list of fields"},
      {list("[('a', '<f4') ('b', '<f4')]"), "expected a list of fields"},
      {list("[(a, '<f4')]"), "expected a list of fields"},
      {list("[('a', '|V65536'), ('b', '|u1')]"), "at most 64 KiB in all"},
      {list("[('a', '|V65537')]"), "at most 64 KiB in all"},
      {list("[('a', '<f8', (8193,))]"), "at most 64 KiB in all"},
      {list("[('a', '<f4', (300, 300))]"), "at most 64 KiB in all"},
      {list("[('a', '<f4', (x,))]"), "expected a list of fields"},
      {nested(10), "expected a list of fields"},
      {shaped("'<f4'", "(2, x)"), "shape = '(2, x)': expected a list of sizes"},
      {shaped("'<f4'", "3"), "shape = "},
      {npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3"), "shape = '(2, 3'"},
      {shaped("'<f4'", "(9007199254740993,)"), "at most 2^53 numbers"},
      {shaped("'<f4'", "(134217728, 134217728)"), "at most 2^53 numbers"},
      {shaped("[('a', '|V16')]", "(9007199254740992,)"), "at most 2^53 numbers"},
  };
  for (const auto& [bytes, expected] : cases) {
    EXPECT_THAT(errorOfHeader(bytes),
                testing::AllOf(HasSubstr("the array's header: "), HasSubstr(expected)))
        << bytes;
  }
}

}  // namespace
}  // namespace efm
