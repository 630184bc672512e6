// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "test/studies/methods/method_comparison.h"

namespace efm::studies {

/// One number of a set of errors, for trends and curves.
using ErrorFigure = double (*)(const DepthErrors&);

double meanCm(const DepthErrors& errors);
double medianCm(const DepthErrors& errors);
/// 5 px and 5 %, as the paper's scripts count it.
double badPercent(const DepthErrors& errors);
double thousandPoints(const DepthErrors& errors);

/// The figure of each method, on its own pixels (`&MethodResult::own`) or on others.
std::vector<double> eachOf(const std::vector<MethodResult>& results,
                           DepthErrors MethodResult::*pixels, ErrorFigure figure);

/// "1.5, 2.0, 3.1"
std::string listed(const std::vector<double>& values, int decimals = 1);
/// "+3.1 %": how much more the first is than the second.
std::string percentMore(double value, double than);
bool grows(const std::vector<double>& values);

}  // namespace efm::studies
