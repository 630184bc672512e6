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

/// What a study says: Markdown, collected part by part, and pictures, written at once.
class StudySection {
 public:
  /// @param pictures the folder of pictures; they are linked as `studies/<file>`.
  StudySection(std::string title, std::filesystem::path pictures);

  /// Paragraphs; lines are wrapped.
  void text(const std::string& paragraph);
  void item(const std::string& text);
  void heading(const std::string& text);
  /// @throws std::logic_error where a row is not as long as the head.
  void table(const TextTable& table);
  /// @param file name without a folder, ending in .png.
  /// @throws std::runtime_error naming the file that cannot be written.
  void picture(const std::string& file, const cv::Mat& picture, const std::string& caption);
  /// One of the paper's trends and whether the numbers show it.
  /// @param departure why, said only where they do not.
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

/// A number with so many decimals.
std::string formatNumber(double value, int decimals);

}  // namespace efm::studies
