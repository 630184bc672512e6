// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>
#include <unistd.h>
#include <wordexp.h>

#include <csignal>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/app/program.h"
#include "test/plugin/program_test.h"

namespace efm {

/// Tests of event-fusion. They run it in a fork of the test, so its 300 libraries load only once.
class AppTest : public ProgramTest {
 protected:
  Result run(const std::string& arguments) const override {
    return interrupted(arguments, [] { return false; });
  }

  /// Runs event-fusion and sends it a signal as soon as `ready` holds, unless it ended before.
  template <typename Ready>
  Result interrupted(const std::string& arguments, Ready ready, int signal = SIGINT) const {
    std::cout.flush();
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child == 0) _exit(runHere(arguments));
    int status = -1;
    while (waitpid(child, &status, WNOHANG) == 0) {
      if (ready()) {
        kill(child, signal);
        EXPECT_EQ(waitpid(child, &status, 0), child);
        break;
      }
      usleep(500);
    }
    return resultOf(status);
  }

  nlohmann::json reportIn(const std::string& name) const {
    return nlohmann::json::parse(contentOf(name + "/report.json"));
  }
  std::vector<StampedPose> posesIn(const std::string& name,
                                   const std::string& file = "trajectory.txt") const {
    return readPoses(folder() / name / file);
  }
  cv::Mat image(const std::filesystem::path& file) const {
    return cv::imread((folder() / file).string(), cv::IMREAD_UNCHANGED);
  }

 private:
  int runHere(const std::string& arguments) const {
    for (const int number : {SIGINT, SIGTERM})
      std::signal(number, SIG_DFL);  // the parent may ignore the signal
    wordexp_t words{};
    const bool ready = chdir(folder().c_str()) == 0 && std::freopen("/dev/null", "r", stdin) &&
                       std::freopen("stdout.txt", "w", stdout) &&
                       std::freopen("stderr.txt", "w", stderr) &&
                       wordexp(("event-fusion " + arguments).c_str(), &words, WRDE_NOCMD) == 0;
    return ready ? runProgram(static_cast<int>(words.we_wordc), words.we_wordv) : 127;
  }
};

}  // namespace efm
