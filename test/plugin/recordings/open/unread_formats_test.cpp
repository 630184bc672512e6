// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_formats.h"

#include <gtest/gtest.h>

#include "test/plugin/recordings/columns/zip_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using namespace std::string_literals;

class UnreadFormats : public TemporaryFolder {
 protected:
  std::string nameOf(const std::string& bytes) const {
    writeFile(folder() / "file", bytes);
    EXPECT_EQ(detectFormat(folder() / "file"), nullptr) << bytes;
    return unreadFormat(folder() / "file").value_or("");
  }
};

/// @return whether `text` begins with `start`.
testing::AssertionResult begins(const std::string& text, const std::string& start) {
  if (text.compare(0, start.size(), start) == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "'" << text << "' begins not with '" << start << "'";
}

TEST_F(UnreadFormats, AreNamedByTheirFirstBytes) {
  const std::pair<std::string, const char*> cases[] = {
      {"version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "a pointer of git-LFS"},
      {"% Data file containing CD events.\n% Version 2\n% Height 720\n\x0c\x08", "a DAT file of P"},
      {"#!AER-DAT1.0\r\n", "an AEDAT 1 file: "},
      {"#!AER-DAT2.0\r\n# raw AE data\r\n", "an AEDAT 2 file: "},
      {"#!AER-DAT3.1\r\n", "an AEDAT 3 file: "},
      {"\xd4\xc3\xb2\xa1\x02\0\x04\0"s, "a network capture (PCAP)"},
      {"\x0a\x0d\x0d\x0a\x1c\0\0\0"s, "a network capture (PCAPNG)"},
      {"\x89PNG\r\n\x1a\n", "a PNG picture"},
      {"\xff\xd8\xff\xe0", "a JPEG picture"},
      {"II*\0\x08"s, "a TIFF picture"},
      {"RIFF\x10\0\0\0AVI LIST"s, "an AVI video"},
      {"\0\0\0\x18"s + "ftypmp42", "an MP4 video"},
      {"\x1a\x45\xdf\xa3", "a Matroska video"},
      {"7z\xbc\xaf\x27\x1c\0\4"s, "a 7z archive: unpack it"},
      {"Rar!\x1a\x07\x01\0"s, "a RAR archive: unpack it"},
      {"a.bag" + std::string(252, '\0') + "ustar", "a tar archive: unpack it"},
      {"PAR1\x15", "a Parquet file"},
      {"MATLAB 5.0 MAT-file, Platform: GLNXA64", "a MATLAB file"},
      {"MATLAB 7.3 MAT-file, Platform: GLNXA64", "a MATLAB file"},
      {"\x80\x04\x95\x10", "a pickle of Python objects"},
      {"\x7f\x45LF\x02", "a program (ELF)"},
      {"%PDF-1.5\n", "a PDF document"},
      {"ply\nformat ascii 1.0\n", "a point cloud"},
      {"\n <!DOCTYPE HTML>\n<html>", "an HTML page: the download failed"},
      {"<html lang=\"en\">", "an HTML page"},
      {"<?xml version=\"1.0\"?><Error/>", "an XML document"},
      {"", "an empty file"},
      {std::string(512, '\0'), "a file of zeros"},
  };
  for (const auto& [bytes, name] : cases) EXPECT_TRUE(begins(nameOf(bytes), name));
}

TEST_F(UnreadFormats, OwnResultsSayWhatShowsThem) {
  const std::string what =
      ": expected a recording; `event-fusion view` shows a map, `event-fusion ev";
  const std::string report = R"({"version": "1", "votes_per_second": 1})";
  EXPECT_TRUE(begins(nameOf(report), "the report of an earlier run" + what));
  EXPECT_EQ(nameOf(R"({"version": "1"})"), "");
  EXPECT_TRUE(begins(nameOf("<!DOCTYPE html>\n<meta name=\"generator\" content=\"event-fusion\">"),
                     "the page of a map" + what));
  EXPECT_TRUE(begins(nameOf("# .PCD v0.7 - Point Cloud Data\n"), "a point cloud (PCD)" + what));
  std::filesystem::remove(folder() / "file");
  writeFile(folder() / "map.html", "<!DOCTYPE html>");
  writeFile(folder() / "report.json", "{}");
  EXPECT_TRUE(begins(unreadFormat(folder()).value_or(""), "a folder; map.html in it is an HTML"));
  writeFile(folder() / "report.json", report);
  EXPECT_TRUE(begins(unreadFormat(folder()).value_or(""), "the result of an earlier run" + what));
}

TEST_F(UnreadFormats, AreNamedWithinCompressedFiles) {
  const std::filesystem::path file = folder() / "file";
  const auto name_of_zip = [&](const std::vector<std::pair<std::string, std::string>>& members) {
    writeZip(file, members);
    return unreadFormat(file).value_or("");
  };
  EXPECT_TRUE(
      begins(name_of_zip({{"a.txt", "1 2"}, {"b.txt", "1 2"}}), "a zip archive: unpack it"));
  EXPECT_TRUE(begins(name_of_zip({{"a.bag", "#ROSBAG V2.0\n"}}), "a compressed ROS 1 bag: unpack"));
  EXPECT_TRUE(begins(name_of_zip({{"a.png", "\x89PNG\r\n"}}), "a PNG picture"));
  writeGzip(file, "\x89HDF\r\n\x1a\n");
  EXPECT_TRUE(begins(unreadFormat(file).value_or(""), "a compressed HDF5 file: unpack it"));
  writeGzip(file, "a.bag" + std::string(252, '\0') + "ustar");
  EXPECT_TRUE(begins(unreadFormat(file).value_or(""), "a tar archive: unpack it"));
}

TEST_F(UnreadFormats, OthersHaveNoName) {
  // A rawlog's first object, an unknown file, and text that mentions a magic.
  for (const std::string& bytes :
       {"\x93"s + "CObservationRobotPose", "\x01\x02\x03"s, "see <html>"s, " ftypmp42"s}) {
    EXPECT_EQ(nameOf(bytes), "");
  }
  EXPECT_FALSE(unreadFormat(folder() / "none"));
}

TEST_F(UnreadFormats, AFolderIsNamedByTheFilesInIt) {
  const auto folder_of = [&](const std::string& name, const std::string& bytes) {
    std::filesystem::remove_all(folder() / "in");
    std::filesystem::create_directory(folder() / "in");
    if (!name.empty()) writeFile(folder() / "in" / name, bytes);
    return unreadFormat(folder() / "in").value_or("");
  };
  EXPECT_EQ(folder_of("", ""), "an empty folder: expected a recording");
  EXPECT_TRUE(begins(folder_of("1.png", "\x89PNG\r\n\x1a\n"), "a folder; 1.png in it is a PNG pi"));
  EXPECT_TRUE(begins(folder_of("0.mcap", "\x89MCAP0\r\n"),
                     "a folder: give its files themselves (0.mcap is a ROS 2 bag"));
  EXPECT_EQ(folder_of("readme", "words"), "");
  for (const char* name : {"m.png", "b.png", "a", "aa", "ab", "ac", "h.png"}) {  // the first known
    writeFile(folder() / "in" / name, name[0] == 'a' ? "words" : "\x89PNG\r\n\x1a\n");
  }
  EXPECT_TRUE(begins(unreadFormat(folder() / "in").value_or(""), "a folder; b.png in it is a PNG"));
}

}  // namespace
}  // namespace efm
