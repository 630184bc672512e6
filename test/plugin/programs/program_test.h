// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "test/paths.h"
#include "test/plugin/formats/dataset_of.h"
#include "test/plugin/session/synthetic_recording.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/poses/tum_trajectory.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

/// Tests that run programs inside the test's folder, without a terminal.
class ProgramTest : public TemporaryFolder {
 protected:
  struct Result {
    int status = 0;
    std::string out;  ///< Of the program, its standard error included.
  };

  /// @param command as a shell takes it.
  Result run(const std::string& command) const {
    const std::string line =
        "cd '" + folder().string() + "' && " + command + " </dev/null >output.txt 2>&1";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contentOf("output.txt")};
  }
  /// The same with the plugin loaded before, for programs without an option for it.
  Result runWithPlugin(const std::string& command) const {
    return run("env LD_PRELOAD='" EFM_PLUGIN "' " + command);
  }
  static bool isInstalled(const std::string& program) {
    return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
  }

  std::string contentOf(const std::string& file) const {
    std::ifstream stream(folder() / file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }
  void write(const std::string& file, const std::string& text) const {
    std::ofstream(folder() / file, std::ios::binary) << text;
  }

  /// Imports a recording as "data.rawlog".
  void importRecording(const SyntheticRecording& recording) const {
    writeDataset(recording, folder() / "data");
    const Result result = run("'" EFM_EVENT_FUSION "' import data --out data.rawlog");
    ASSERT_EQ(result.status, 0) << result.out;
  }

  /// The options as a file has them, with a prefix before the sections' names.
  static std::string optionText(const EventFusionOptions& options, const std::string& prefix = "") {
    std::string text;
    std::string section;
    for (const NamedOption& option : listOptions(options)) {
      if (option.section != section) text += "[" + prefix + std::string(option.section) + "]\n";
      section = option.section;
      text += std::string(option.key) + " = " + textOf(option.value) + "\n";
    }
    return text;
  }

  /// Writes "rig.ini" and maps "data.rawlog" to the folder "out".
  void map(const EventFusionOptions& options) const {
    write("rig.ini", optionText(options));
    const Result result = run("'" EFM_EVENT_FUSION "' map rig.ini data.rawlog --out out");
    ASSERT_EQ(result.status, 0) << result.out;
  }
};

}  // namespace efm
