// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/open_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsSupersetOf;

class OpenRecording : public TemporaryFolder {
 protected:
  static std::string errorOf(const std::vector<std::filesystem::path>& sources,
                             const std::string& format = "auto") {
    try {
      RecordingSource source;
      source.files = sources;
      source.format = format;
      openRecording(source);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(OpenRecording, AMissingSourceIsNamed) {
  EXPECT_THAT(errorOf({folder() / "nowhere"}), HasSubstr("nowhere: no such file or folder"));
}

TEST_F(OpenRecording, AnotherFolderIsAnErrorThatNamesTheExpectedFiles) {
  std::ofstream(folder() / "notes.txt") << "nothing";
  EXPECT_THAT(errorOf({folder()}), AllOf(HasSubstr("not a recording"), HasSubstr("camchain.yaml"),
                                         HasSubstr("events.txt"), HasSubstr("calib.txt")));
}

TEST_F(OpenRecording, AnUnknownFormatIsNamed) {
  EXPECT_THAT(errorOf({folder()}, "tape"), HasSubstr("'tape'"));
}

TEST_F(OpenRecording, FormatsBeginWithAuto) {
  const std::vector<std::string> names = recordingFormats();
  EXPECT_EQ(names.front(), "auto");
  EXPECT_THAT(names, IsSupersetOf({"rawlog", "folder", "uzh"}));
}

}  // namespace
}  // namespace efm
