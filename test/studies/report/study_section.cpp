// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/report/study_section.h"

#include <array>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace efm::studies {
namespace {

std::string row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line + "\n";
}

}  // namespace

StudySection::StudySection(std::string title, std::filesystem::path pictures)
    : title_(std::move(title)), pictures_(std::move(pictures)) {}

void StudySection::text(const std::string& paragraph) {
  if (in_list_) markdown_ += "\n";
  in_list_ = false;
  wrapped("", "", paragraph);
  markdown_ += "\n";
}

void StudySection::item(const std::string& text) {
  wrapped("- ", "  ", text);
  in_list_ = true;
}

void StudySection::heading(const std::string& text) {
  if (in_list_) markdown_ += "\n";
  in_list_ = false;
  markdown_ += "### " + text + "\n\n";
}

void StudySection::table(const TextTable& table) {
  if (in_list_) markdown_ += "\n";
  in_list_ = false;
  markdown_ += row(table.head);
  markdown_ += "|---|";
  for (std::size_t i = 1; i < table.head.size(); ++i) markdown_ += "---:|";
  markdown_ += "\n";
  for (const std::vector<std::string>& cells : table.rows) {
    if (cells.size() != table.head.size())
      throw std::logic_error("a row has too few or many cells");
    markdown_ += row(cells);
  }
  markdown_ += "\n";
}

void StudySection::picture(const std::string& file, const cv::Mat& picture,
                           const std::string& caption) {
  const std::filesystem::path path = pictures_ / file;
  if (!cv::imwrite(path.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 9})) {
    throw std::runtime_error(path.string() + ": cannot be written");
  }
  if (in_list_) markdown_ += "\n";
  in_list_ = false;
  markdown_ += "![" + caption + "](studies/" + file + ")\n\n";
  wrapped("*", "", caption + "*");
  markdown_ += "\n";
}

void StudySection::trend(const std::string& claim, bool agrees, const std::string& figures,
                         const std::string& departure) {
  std::string words = (agrees ? "**agrees**: " : "**departs**: ") + claim + " (" + figures + ").";
  if (!agrees && !departure.empty()) words += " " + departure;
  item(words);
}

void StudySection::wrapped(const std::string& first_indent, const std::string& indent,
                           const std::string& words) {
  constexpr std::size_t kColumns = 118;
  std::istringstream stream(words);
  std::string line = first_indent;
  std::string word;
  bool empty = true;
  while (stream >> word) {
    if (!empty && line.size() + 1 + word.size() > kColumns) {
      markdown_ += line + "\n";
      line = indent;
      empty = true;
    }
    line += (empty ? "" : " ") + word;
    empty = false;
  }
  markdown_ += line + "\n";
}

std::string formatNumber(double value, int decimals) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

}  // namespace efm::studies
