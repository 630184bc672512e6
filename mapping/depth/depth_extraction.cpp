// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/depth_extraction.h"

#include <cmath>

#include "mapping/base/named_choice.h"
#include "mapping/base/option_check.h"
#include "mapping/depth/aggregated_extraction.h"
#include "mapping/depth/paper_extraction.h"

namespace efm {
namespace {

constexpr NamedChoice<ExtractionMethod> kMethods[] = {
    {ExtractionMethod::kPaper, "paper"},
    {ExtractionMethod::kAggregated, "aggregated"},
};

}  // namespace

std::string_view nameOf(ExtractionMethod method) { return nameIn(kMethods, method); }
ExtractionMethod extractionMethodFromName(std::string_view name) { return valueIn(kMethods, name); }

void DepthExtractionOptions::validate() const {
  requireOption(threshold_kernel >= 3 && threshold_kernel <= 255 && threshold_kernel % 2 == 1,
                "threshold_kernel", threshold_kernel, "odd, 3 to 255");
  requireOption(threshold_c >= -255 && threshold_c <= 255, "threshold_c", threshold_c,
                "-255 to 255");
  requireOption(max_confidence.level != WhiteLevel::kFixed ||
                    (std::isfinite(max_confidence.fixed) && max_confidence.fixed > 0),
                "max_confidence", max_confidence.fixed, "finite and above 0");
  requireOption(min_local_contrast > 0 && std::isfinite(min_local_contrast), "min_local_contrast",
                min_local_contrast, "finite and above 0");
  requireOption(min_quality >= 0 && std::isfinite(min_quality), "min_quality", min_quality,
                "finite, 0 or above");
  requireOption(median_size >= 1 && median_size <= 255 && median_size % 2 == 1, "median_size",
                median_size, "odd, 1 to 255");
}

bool usesColumns(ExtractionMethod method) { return method == ExtractionMethod::kAggregated; }

DepthMap extractDepth(const SweptDsi& dsi, const DepthPlanes& planes,
                      const DepthExtractionOptions& options, const KeyframeFacts& facts) {
  options.validate();
  if (options.extraction == ExtractionMethod::kPaper) {
    return extractAsPaper(dsi.peaks, planes, options, facts.sequence_maximum);
  }
  return extractAggregated(dsi, planes, options, facts.parallax_px_m);
}

}  // namespace efm
