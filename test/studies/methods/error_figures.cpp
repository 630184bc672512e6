// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/error_figures.h"

#include <algorithm>

#include "test/studies/report/study_section.h"

namespace efm::studies {

double meanCm(const DepthErrors& errors) { return 100 * errors.mean_abs_m; }
double medianCm(const DepthErrors& errors) { return 100 * errors.median_abs_m; }
double badPercent(const DepthErrors& errors) { return 100 * errors.bad_pix_5px.value_or(0); }
double thousandPoints(const DepthErrors& errors) {
  return 1e-3 * static_cast<double>(errors.points);
}

std::vector<double> eachOf(const std::vector<MethodResult>& results,
                           DepthErrors MethodResult::*pixels, ErrorFigure figure) {
  std::vector<double> values;
  for (const MethodResult& result : results) values.push_back(figure(result.*pixels));
  return values;
}

std::string listed(const std::vector<double>& values, int decimals) {
  std::string text;
  for (const double value : values) {
    text += (text.empty() ? "" : ", ") + formatNumber(value, decimals);
  }
  return text;
}

std::string percentMore(double value, double than) {
  const double percent = 100 * (value / than - 1);
  return (percent < 0 ? "" : "+") + formatNumber(percent, 1) + " %";
}

bool grows(const std::vector<double>& values) {
  return std::is_sorted(values.begin(), values.end());
}

}  // namespace efm::studies
