// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "plugin/options/option_file.h"
#include "plugin/options/option_keys.h"
#include "test/paths.h"
#include "test/plugin/session/synthetic_recording.h"
#include "test/plugin/temporary_folder.h"

namespace efm {

/// Tests that run programs in the test's folder, without a terminal. File names are relative to the
/// folder.
class ProgramTest : public TemporaryFolder {
 protected:
  struct Result {
    int status = 0;
    std::string out;
    std::string err;
    std::string notes{};  ///< The lines "note: poses-unchecked", which short recordings have.
  };

  /// Runs a shell command.
  Result shell(const std::string& command) const {
    return resultOf(std::system(
        ("cd '" + folder().string() + "' && " + command + " </dev/null >stdout.txt 2>stderr.txt")
            .c_str()));
  }
  /// Leaves out the progress, which a slow run prints.
  /// @param status from waitpid.
  Result resultOf(int status) const {
    Result result{WIFEXITED(status) ? WEXITSTATUS(status) : -1, contentOf("stdout.txt"), ""};
    std::istringstream err(contentOf("stderr.txt"));
    for (std::string line; std::getline(err, line);) {
      if (isProgress(line)) continue;
      const bool note = line.rfind("event-fusion: note: poses-unchecked", 0) == 0;
      (note ? result.notes : result.err) += line + (err.eof() ? "" : "\n");
    }
    return result;
  }
  /// Returns whether a line is like "event-fusion: first look  43 %, 12 s left".
  static bool isProgress(const std::string& line) {
    const std::string begin = "event-fusion: ";
    const std::size_t percent = line.find(" %");
    return line.rfind(begin, 0) == 0 && percent != std::string::npos &&
           line.find(':', begin.size()) > percent &&
           (percent + 2 == line.size() || line[percent + 2] == ',');
  }
  /// Runs event-fusion. Arguments are quoted as in a shell.
  virtual Result run(const std::string& arguments) const {
    return shell("'" EFM_EVENT_FUSION "' " + arguments);
  }
  /// Runs event-fusion, which must fail. @return its error message.
  std::string errorOf(const std::string& arguments) const {
    const Result result = run(arguments);
    EXPECT_NE(result.status, 0) << arguments;
    return result.err;
  }
  static bool isInstalled(const std::string& program) {
    return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
  }

  std::string contentOf(const std::filesystem::path& file) const {
    std::ifstream stream(folder() / file, std::ios::binary);
    EXPECT_TRUE(stream) << file;
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }
  void write(const std::filesystem::path& file, const std::string& text) const {
    std::filesystem::create_directories((folder() / file).parent_path());
    std::ofstream(folder() / file, std::ios::binary) << text;
  }
  /// Returns all files in a folder, sorted.
  std::vector<std::string> filesIn(const std::string& name) const {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder() / name)) {
      if (entry.is_directory()) continue;
      files.push_back(entry.path().lexically_relative(folder() / name).string());
    }
    std::sort(files.begin(), files.end());
    return files;
  }

  /// Writes the recording as a dataset folder "data" and `syntheticOptions` as "rig.ini".
  void write(const SyntheticRecording& recording) const {
    writeDataset(recording, folder() / "data");
    write("rig.ini", optionText());
  }
  /// Returns `syntheticOptions` as an option file. `prefix` stands before the section names.
  static std::string optionText(const std::string& prefix = "") {
    std::string text;
    std::string section;
    for (const NamedOption& option : listOptions(syntheticOptions())) {
      if (option.section != section) text += "[" + prefix + std::string(option.section) + "]\n";
      section = option.section;
      text += std::string(option.key) + " = " + textOf(option.value) + "\n";
    }
    return text;
  }
  /// Imports the recording as "data.rawlog".
  void importRecording(const SyntheticRecording& recording) const {
    write(recording);
    const Result result = run("import data --out data.rawlog");
    ASSERT_EQ(result.status, 0) << result.err;
  }
  /// Maps "data" or another recording with "rig.ini" to folder `out`. @return map.pcd's content.
  std::string mapOf(const std::string& arguments, const std::string& out = "out") const {
    const Result result = run("map rig.ini " + arguments + " --out " + out);
    EXPECT_EQ(result.status, 0) << result.err;
    return contentOf(out + "/map.pcd");
  }
};

}  // namespace efm
