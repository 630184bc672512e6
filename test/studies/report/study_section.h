// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace efm::studies {

/// A table of Markdown.
struct TextTable {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;  ///< As long as the head.
};

/// The text of a study in Markdown. Pictures are written at once.
class StudySection {
 public:
  /// @param pictures folder of the pictures. Links are `studies/<file>`.
  StudySection(std::string title, std::filesystem::path pictures);

  /// Paragraphs; lines are wrapped.
  void text(const std::string& paragraph);
  void item(const std::string& text);
  void heading(const std::string& text);
  /// @throws std::logic_error where a row and the head have different lengths.
  void table(const TextTable& table);
  /// @param file name without a folder, ending in .png.
  /// @throws std::runtime_error naming the file that cannot be written.
  void picture(const std::string& file, const cv::Mat& picture, const std::string& caption);
  /// A trend of the paper, and whether the numbers agree.
  /// @param departure the reason, printed only where they do not agree.
  void trend(const std::string& claim, bool agrees, const std::string& figures,
             const std::string& departure = "");

  const std::string& title() const { return title_; }
  const std::string& markdown() const { return markdown_; }

 private:
  void wrapped(const std::string& first_indent, const std::string& indent,
               const std::string& words);

  std::string title_;
  std::filesystem::path pictures_;
  std::string markdown_;
  bool in_list_ = false;
};

/// A number with fixed decimals.
std::string formatNumber(double value, int decimals);

}  // namespace efm::studies
