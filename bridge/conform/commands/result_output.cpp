#include "bridge/conform/commands/result_output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

#include "bridge/conform/report_page.hpp"

namespace trestle::conform {
namespace {

void write(const std::string& file, const std::string& text) {
  std::ofstream out{file, std::ios::binary};
  out << text;
  if (!out.flush()) {
    throw std::runtime_error{"cannot write " + file};
  }
}

}  // namespace

ResultTree::ResultTree(const RunInfo& info) : info_{info}, colours_{cli::colours_for(STDOUT_FILENO)} {}

void ResultTree::add(const CaseResult& result) {
  if (const std::string area = group_of(result.what->id); area != area_) {
    area_ = area;
    fmt::print("{}{}{}\n", colours_.bold, area, colours_.off);
  }
  fmt::print("{}\n", case_text(result, info_, colours_));
  std::fflush(stdout);
}

void write_results(const RunResult& run, const RunInfo& info) {
  write(info.folder + "/junit.xml", junit_xml(run, info));
  write(info.folder + "/results.json", results_json(run, info));
  write(info.folder + "/report.html", report_page(run, info));
}

}  // namespace trestle::conform
