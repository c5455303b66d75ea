#pragma once
#include <string>

#include "bridge/conform/report.hpp"

namespace trestle::conform {

/// The results as a page for browsers: one file that needs nothing else. Its look and script are in
/// bridge/web/assets/conform.
[[nodiscard]] std::string report_page(const RunResult& run, const RunInfo& info);

}  // namespace trestle::conform
