// SPDX-License-Identifier: BSD-3-Clause
// `event-fusion view` as a user runs it, with a made-up opener in the PATH.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class ViewCommand : public AppTest {
 protected:
  /// The opener ends with a status.
  void putOpener(int status) {
    write("bin/xdg-open", "#!/bin/sh\necho \"$1\" >opened.txt\necho chatter\nexit " +
                              std::to_string(status) + "\n");
    std::filesystem::permissions(folder() / "bin" / "xdg-open", std::filesystem::perms::owner_all);
    setenv("PATH", ((folder() / "bin").string() + ":" + path_).c_str(), 1);
    setenv("DISPLAY", ":0", 1);
  }
  ~ViewCommand() override {
    setenv("PATH", path_.c_str(), 1);
    unsetenv("DISPLAY");
  }

  std::string path_ = std::getenv("PATH");
};

TEST_F(ViewCommand, OpensThePageOfAFolder) {
  putOpener(0);
  write("my map/map.html", "a page");
  const std::string page = (folder() / "my map" / "map.html").string();
  for (const char* arguments : {"view 'my map'", "view 'my map/'", "view 'my map/map.html'"}) {
    const Result result = run(arguments);
    EXPECT_EQ(result.status, 0) << arguments;
    EXPECT_THAT(result.err, IsEmpty()) << arguments;
    EXPECT_EQ(result.out, page + "\n") << arguments;
    EXPECT_EQ(contentOf("opened.txt"), page + "\n") << arguments;
    std::filesystem::remove(folder() / "opened.txt");
  }
}

TEST_F(ViewCommand, SaysWhereThePageIsIfNothingOpensIt) {
  putOpener(4);
  write("out/map.html", "a page");
  const Result failed = run("view out");
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  std::filesystem::remove(folder() / "opened.txt");
  const Result without_screen = run("view out");
  for (const Result& result : {failed, without_screen}) {
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.out, (folder() / "out" / "map.html").string() + "\n");
    EXPECT_THAT(result.err, HasSubstr("no browser could be started here: open the file in one"));
  }
  EXPECT_FALSE(exists(folder() / "opened.txt")) << "a browser of the terminal shows no map";
}

}  // namespace
}  // namespace efm
