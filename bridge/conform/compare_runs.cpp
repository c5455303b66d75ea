#include "bridge/conform/compare_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "bridge/conform/report.hpp"

namespace trestle::conform {
namespace {

/// Nothing: it is as it was.
std::optional<CaseChange> change_of(const ReadCase& before, const ReadCase& after) {
  const auto bad = [](Verdict verdict) { return !is_good(verdict) && verdict != Verdict::unsupported; };
  // Why it is not supported may have a number in it that is never the same.
  if (before.verdict == after.verdict && (!bad(before.verdict) || before.reason == after.reason)) {
    return std::nullopt;
  }
  return is_good(before.verdict) && bad(after.verdict)   ? CaseChange::broke
         : bad(before.verdict) && is_good(after.verdict) ? CaseChange::mended
                                                         : CaseChange::other;
}

const char* heading_of(CaseChange change) {
  switch (change) {
    case CaseChange::broke:
      return "broke";
    case CaseChange::mended:
      return "mended";
    case CaseChange::other:
      return "changed";
    case CaseChange::gone:
      return "gone";
    case CaseChange::added:
      return "new";
  }
  return "";
}

std::string with_reason(const ReadCase& one) {
  return one.reason.empty() ? to_string(one.verdict)
                            : fmt::format("{}: {}", to_string(one.verdict), one.reason);
}

std::string change_text(const ChangedCase& one) {
  switch (one.change) {
    case CaseChange::gone:
      return fmt::format("was {}", to_string(one.before.verdict));
    case CaseChange::added:
      return with_reason(one.after);
    default:
      // What was wrong before matters where it is not wrong any more.
      return is_good(one.after.verdict)
                 ? fmt::format("{} -> {}", with_reason(one.before), to_string(one.after.verdict))
                 : fmt::format("{} -> {}", to_string(one.before.verdict), with_reason(one.after));
  }
}

std::string name_of(const ReadRun& run) {
  return run.version.empty() ? run.name : run.name + " " + run.version;
}

std::string count_text(const StackMatrix::Count& count) {
  return count.judged == 0 ? "-" : fmt::format("{}/{}", count.good, count.judged);
}

/// Short, for a column.
const char* word_of(const std::optional<ReadCase>& result) {
  return !result ? "-" : to_string(result->verdict);
}

/// The text in a cell of a table in Markdown.
std::string cell(std::string_view text) {
  std::string all;
  for (const char c : text) {
    all += c == '|' ? "\\|" : c == '\n' ? " " : std::string(1, c);
  }
  return all;
}

}  // namespace

std::size_t RunComparison::count(CaseChange change) const {
  return static_cast<std::size_t>(std::ranges::count(changes, change, &ChangedCase::change));
}

RunComparison compare(const ReadRun& before, const ReadRun& after) {
  RunComparison result;
  for (const auto& [id, one] : before.cases) {
    const auto now = after.cases.find(id);
    if (now == after.cases.end()) {
      result.changes.push_back({.id = id, .change = CaseChange::gone, .before = one});
    } else if (const auto change = change_of(one, now->second)) {
      result.changes.push_back({.id = id, .change = *change, .before = one, .after = now->second});
    } else {
      ++result.same;
    }
  }
  for (const auto& [id, one] : after.cases) {
    if (!before.cases.contains(id)) {
      result.changes.push_back({.id = id, .change = CaseChange::added, .after = one});
    }
  }
  std::ranges::stable_sort(result.changes, {}, &ChangedCase::change);
  return result;
}

std::string comparison_text(const ReadRun& before, const ReadRun& after, const cli::Colours& colours) {
  const RunComparison comparison = compare(before, after);
  std::string all =
      fmt::format("{} ({}) -> {} ({})\n", name_of(before), before.started, name_of(after), after.started);
  std::optional<CaseChange> heading;
  for (const ChangedCase& one : comparison.changes) {
    if (heading != one.change) {
      heading = one.change;
      const char* colour = one.change == CaseChange::broke    ? colours.red
                           : one.change == CaseChange::mended ? colours.green
                                                              : colours.bold;
      all += fmt::format("{}{} ({}){}\n", colour, heading_of(one.change), comparison.count(one.change),
                         colours.off);
    }
    all += fmt::format("  {:40} {}\n", one.id, change_text(one));
  }
  all += fmt::format("{} as before\n", comparison.same);
  const auto tell_if_cancelled = [&](const ReadRun& run, const char* which) {
    if (run.cancelled) {
      all += fmt::format("{}{}{}: it was ended before all cases were run, and has {} of them\n", colours.red,
                         which, colours.off, run.cases.size());
    }
  };
  tell_if_cancelled(before, "the run before is not complete");
  tell_if_cancelled(after, "the run after is not complete");
  return all;
}

StackMatrix matrix_of(const std::vector<ReadRun>& runs) {
  StackMatrix matrix;
  std::set<std::string> ids;
  std::set<std::string> areas;
  for (const ReadRun& run : runs) {
    std::string name = name_of(run);
    for (int number = 2; std::ranges::find(matrix.names, name) != matrix.names.end(); ++number) {
      name = fmt::format("{} ({})", name_of(run), number);
    }
    matrix.names.push_back(name);
    for (const auto& [id, one] : run.cases) {
      ids.insert(id);
      areas.insert(group_of(id));
    }
  }
  matrix.sums.resize(runs.size());
  for (const std::string& name : areas) {
    StackMatrix::Area area{.name = name};
    for (std::size_t at = 0; at < runs.size(); ++at) {
      StackMatrix::Count count;
      for (const auto& [id, one] : runs[at].cases) {
        if (group_of(id) == name && one.verdict != Verdict::unsupported) {
          ++count.judged;
          count.good += is_good(one.verdict) ? 1 : 0;
        }
      }
      area.counts.push_back(count);
      matrix.sums[at].good += count.good;
      matrix.sums[at].judged += count.judged;
    }
    matrix.areas.push_back(std::move(area));
  }
  for (const std::string& id : ids) {
    StackMatrix::Difference row{.id = id};
    for (const ReadRun& run : runs) {
      const auto found = run.cases.find(id);
      row.results.push_back(found == run.cases.end() ? std::nullopt : std::optional{found->second});
      row.title = found == run.cases.end() ? row.title : found->second.title;
    }
    const bool alike = std::ranges::all_of(row.results, [&](const std::optional<ReadCase>& one) {
      return word_of(one) == std::string_view{word_of(row.results.front())};
    });
    if (!alike) {
      matrix.differences.push_back(std::move(row));
    }
  }
  return matrix;
}

std::string matrix_text(const StackMatrix& matrix, const cli::Colours& colours) {
  std::size_t first = 12;
  for (const auto& area : matrix.areas) {
    first = std::max(first, area.name.size());
  }
  for (const auto& row : matrix.differences) {
    first = std::max(first, row.id.size());
  }
  const auto width = [&](std::size_t at) { return std::max<std::size_t>(14, matrix.names[at].size()); };
  std::string all = colours.bold + std::string(first, ' ');
  for (std::size_t at = 0; at < matrix.names.size(); ++at) {
    all += fmt::format("  {:>{}}", matrix.names[at], width(at));
  }
  all += std::string{colours.off} + "\n";
  const auto counts = [&](const std::string& name, const std::vector<StackMatrix::Count>& row) {
    all += fmt::format("{:{}}", name, first);
    for (std::size_t at = 0; at < row.size(); ++at) {
      const StackMatrix::Count& one = row[at];
      const char* colour = one.judged == 0          ? colours.dim
                           : one.good == one.judged ? colours.green
                                                    : colours.red;
      all += fmt::format("  {}{:>{}}{}", colour, count_text(one), width(at), colours.off);
    }
    all += "\n";
  };
  for (const StackMatrix::Area& area : matrix.areas) {
    counts(area.name, area.counts);
  }
  counts("all", matrix.sums);
  if (!matrix.differences.empty()) {
    all += "\n";
  }
  for (const StackMatrix::Difference& row : matrix.differences) {
    all += fmt::format("{:{}}", row.id, first);
    for (std::size_t at = 0; at < row.results.size(); ++at) {
      const auto& one = row.results[at];
      all += fmt::format("  {}{:>{}}{}", one ? colour_of(one->verdict, colours) : colours.dim, word_of(one),
                         width(at), colours.off);
    }
    all += "\n";
  }
  return all;
}

std::string matrix_markdown(const StackMatrix& matrix) {
  const auto head = [&](const char* first) {
    std::string line = fmt::format("| {} |", first);
    std::string below = "| --- |";
    for (const std::string& name : matrix.names) {
      line += fmt::format(" {} |", cell(name));
      below += " --- |";
    }
    return line + "\n" + below + "\n";
  };
  std::string all = head("area");
  const auto counts = [&](const std::string& name, const std::vector<StackMatrix::Count>& row) {
    all += fmt::format("| {} |", name);
    for (const StackMatrix::Count& one : row) {
      all += fmt::format(" {} |", count_text(one));
    }
    all += "\n";
  };
  for (const StackMatrix::Area& area : matrix.areas) {
    counts(area.name, area.counts);
  }
  counts("all", matrix.sums);
  if (matrix.differences.empty()) {
    return all;
  }
  all += "\n" + head("case");
  for (const StackMatrix::Difference& row : matrix.differences) {
    all += fmt::format("| {}: {} |", row.id, cell(row.title));
    for (const auto& one : row.results) {
      all += fmt::format(" {} |", cell(one ? with_reason(*one) : "-"));
    }
    all += "\n";
  }
  return all;
}

std::string matrix_json(const StackMatrix& matrix) {
  using Json = nlohmann::ordered_json;
  const auto counts = [](const std::vector<StackMatrix::Count>& row) {
    Json all = Json::array();
    for (const StackMatrix::Count& one : row) {
      all.push_back({{"good", one.good}, {"judged", one.judged}});
    }
    return all;
  };
  Json areas = Json::object();
  for (const StackMatrix::Area& area : matrix.areas) {
    areas[area.name] = counts(area.counts);
  }
  Json differences = Json::array();
  for (const StackMatrix::Difference& row : matrix.differences) {
    Json results = Json::array();
    for (const auto& one : row.results) {
      results.push_back(one ? Json{{"verdict", to_string(one->verdict)}, {"reason", one->reason}}
                            : Json(nullptr));
    }
    differences.push_back({{"id", row.id}, {"title", row.title}, {"results", results}});
  }
  const Json document{{"schema", results_schema},
                      {"stacks", matrix.names},
                      {"areas", areas},
                      {"all", counts(matrix.sums)},
                      {"differences", differences}};
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace trestle::conform
