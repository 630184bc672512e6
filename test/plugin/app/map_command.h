// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "test/paths.h"
#include "test/plugin/formats/dataset_of.h"
#include "test/plugin/session/synthetic_recording.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/poses/tum_trajectory.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

inline std::string contentOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// `event-fusion` as a user runs it, on a synthetic recording.
class MapCommand : public TemporaryFolder {
 protected:
  struct Result {
    int status = 0;
    std::string out;
    std::string err;
  };

  /// Runs event-fusion with arguments as a shell takes them, inside the test's folder.
  Result run(const std::string& arguments) const {
    const std::string command = "cd '" + folder().string() + "' && '" EFM_EVENT_FUSION "' " +
                                arguments + " >stdout.txt 2>stderr.txt </dev/null";
    Result result;
    result.status = std::system(command.c_str());
    result.out = contentOf(folder() / "stdout.txt");
    result.err = contentOf(folder() / "stderr.txt");
    return result;
  }

  /// Writes the recording as a dataset folder "data" and the options as "rig.ini".
  void write(const SyntheticRecording& recording) const {
    writeDataset(recording, folder() / "data");

    std::ofstream options(folder() / "rig.ini");
    std::string section;
    for (const NamedOption& option : listOptions(syntheticOptions())) {
      if (option.section != section) options << "[" << option.section << "]\n";
      section = option.section;
      options << option.key << " = " << textOf(option.value) << "\n";
    }
  }

  nlohmann::json reportIn(const std::string& name) const {
    return nlohmann::json::parse(contentOf(folder() / name / "report.json"));
  }

  /// The names of all files below a folder, sorted.
  std::vector<std::string> filesIn(const std::string& name) const {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder() / name)) {
      if (entry.is_directory()) continue;
      files.push_back(entry.path().lexically_relative(folder() / name).string());
    }
    std::sort(files.begin(), files.end());
    return files;
  }
};

}  // namespace efm
