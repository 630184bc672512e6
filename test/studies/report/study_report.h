// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "test/studies/report/study_section.h"

namespace efm::studies {

/// The report of all studies: one Markdown file, a section for each, in order. A run of some
/// studies replaces their sections and leaves the others as they are.
class StudyReport {
 public:
  /// Reads the sections that are there.
  /// @param file need not exist.
  explicit StudyReport(std::filesystem::path file);

  void replace(const std::string& study, const StudySection& section);
  /// @param order the studies' names; sections of others are dropped.
  /// @throws std::runtime_error naming the file where it cannot be written.
  void write(const std::vector<std::string>& order) const;

 private:
  std::filesystem::path file_;
  std::map<std::string, std::string> sections_;  // by the study's name; with their headings
};

}  // namespace efm::studies
