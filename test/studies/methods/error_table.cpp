// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/error_table.h"

#include <string>

namespace efm::studies {
namespace {

std::vector<std::string> row(const std::string& name, const char* pixels, const DepthErrors& errors,
                             bool in_metres) {
  const double per_metre = in_metres ? 1 : 100;
  const auto percent = [](const std::optional<double>& share) {
    return share ? formatNumber(100 * *share, 2) : std::string("-");
  };
  return {name,
          pixels,
          formatNumber(per_metre * errors.mean_abs_m, 2),
          formatNumber(per_metre * errors.median_abs_m, 2),
          percent(errors.bad_pix_5px),
          formatNumber(errors.silog, 2),
          formatNumber(100 * errors.aerrr, 2),
          formatNumber(errors.log_rmse, 2),
          formatNumber(100 * errors.delta[0], 2),
          formatNumber(100 * errors.delta[1], 2),
          formatNumber(100 * errors.delta[2], 2),
          formatNumber(1e-3 * static_cast<double>(errors.points), 1)};
}

}  // namespace

TextTable errorTable(const std::vector<MethodResult>& results, const ErrorTableOptions& options) {
  TextTable table;
  const std::string unit = options.in_metres ? " [m]" : " [cm]";
  table.head = {"method",      "pixels",      "mean" + unit, "median" + unit,
                "bad-pix [%]", "SILog",       "AErrR [%]",   "log RMSE",
                "δ<1.25 [%]",  "δ<1.25² [%]", "δ<1.25³ [%]", "points [thousand]"};
  for (const MethodResult& result : results) {
    table.rows.push_back(row(result.name, "own", result.own, options.in_metres));
    table.rows.push_back(row("", "common", result.common, options.in_metres));
    if (options.equal_numbers) {
      table.rows.push_back(row("", "equal", result.equal, options.in_metres));
    }
  }
  return table;
}

}  // namespace efm::studies
