// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "test/studies/report/study_section.h"

namespace efm::studies {

/// The report of all studies: a Markdown file with a section for each, in order. A run replaces the
/// sections of its studies only.
class StudyReport {
 public:
  /// Reads the existing sections.
  /// @param file need not exist.
  explicit StudyReport(std::filesystem::path file);

  void replace(const std::string& study, const StudySection& section);
  /// @param order names of the studies. Other sections are removed.
  /// @throws std::runtime_error naming the file where it cannot be written.
  void write(const std::vector<std::string>& order) const;

 private:
  std::filesystem::path file_;
  std::map<std::string, std::string> sections_;  // by name of the study; with headings
};

}  // namespace efm::studies
