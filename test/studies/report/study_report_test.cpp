// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/report/study_report.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>
#include <string>

#include "test/plugin/temporary_folder.h"

namespace efm::studies {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class StudyReportFile : public TemporaryFolder {
 protected:
  std::string written() const {
    std::ostringstream text;
    text << std::ifstream(file()).rdbuf();
    return text.str();
  }
  std::filesystem::path file() const { return folder() / "studies.md"; }
  StudySection section(const std::string& text) const {
    StudySection made("A title", folder());
    made.text(text);
    return made;
  }
  void report(const std::string& study, const std::string& text) const {
    StudyReport report(file());
    report.replace(study, section(text));
    report.write({"first", "second"});
  }
};

TEST_F(StudyReportFile, ARunOfOneStudyLeavesTheOthersAsTheyAre) {
  report("second", "of the second");
  report("first", "of the first");
  const std::string both = written();
  EXPECT_LT(both.find("of the first"), both.find("of the second"));
  report("first", "anew");
  EXPECT_THAT(written(), HasSubstr("anew"));
  EXPECT_THAT(written(), HasSubstr("of the second"));
  EXPECT_THAT(written(), Not(HasSubstr("of the first")));
}

TEST_F(StudyReportFile, RunningAgainChangesNothing) {
  report("first", "the same");
  const std::string once = written();
  report("first", "the same");
  EXPECT_EQ(written(), once);
}

TEST_F(StudyReportFile, ATrendThatDepartsSaysWhyAndOneThatAgreesDoesNot) {
  StudySection made("A title", folder());
  made.trend("it grows", true, "1, 2", "because");
  made.trend("it falls", false, "1, 2", "it does not");
  EXPECT_EQ(made.markdown(),
            "- **agrees**: it grows (1, 2).\n- **departs**: it falls (1, 2). it does not\n");
}

}  // namespace
}  // namespace efm::studies
