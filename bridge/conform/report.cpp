#include "bridge/conform/report.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "bridge/documents/xml_text.hpp"

namespace trestle::conform {
namespace {

std::string again(const Case& one, const RunInfo& info) {
  return info.command + " " + one.id;
}

/// That of the case, as a person would name it from where the command ran.
std::string capture(const CaseResult& result, const RunInfo& info) {
  return (std::filesystem::path{info.folder} / result.evidence).lexically_normal().string();
}

std::string difference_lines(const Attempt& outcome, const char* indent) {
  std::string all;
  for (const Difference& one : outcome.differences) {
    all += fmt::format("{}{}: expected {}, got {}{}\n", indent, one.field, one.expected, one.actual,
                       one.packet == 0 ? "" : fmt::format(" (packet {})", one.packet));
  }
  return all;
}

std::string junit_case(const CaseResult& result, const RunInfo& info) {
  const Case& one = *result.what;
  std::string all =
      fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\">\n      <properties>\n",
                  documents::xml_text(one.id.substr(0, one.id.rfind('.'))), documents::xml_text(one.id),
                  static_cast<double>(result.took.count()) / 1000);
  for (const RequirementId& id : one.requirements) {
    all += fmt::format("        <property name=\"requirement\" value=\"{}\"/>\n", id.text());
  }
  for (const Tc8Id& id : one.tc8) {
    all += fmt::format("        <property name=\"tc8\" value=\"{}\"/>\n", id.text());
  }
  if (result.outcome.retries > 0) {
    all += fmt::format("        <property name=\"retries\" value=\"{}\"/>\n", result.outcome.retries);
  }
  all += fmt::format("        <property name=\"verdict\" value=\"{}\"/>\n      </properties>\n",
                     to_string(result.outcome.verdict));
  const std::string reason = documents::xml_text(result.outcome.reason);
  const std::string details = documents::xml_text(fmt::format("{}\n{}evidence: {}\nagain: {}\n", one.title,
                                                              difference_lines(result.outcome, ""),
                                                              capture(result, info), again(one, info)));
  switch (result.outcome.verdict) {
    case Verdict::fail:
      all += fmt::format("      <failure message=\"{}\">{}</failure>\n", reason, details);
      break;
    case Verdict::error:
    case Verdict::inconclusive:
      all += fmt::format("      <error message=\"{}: {}\">{}</error>\n", to_string(result.outcome.verdict),
                         reason, details);
      break;
    case Verdict::unsupported:
      all += fmt::format("      <skipped message=\"{}\"/>\n", reason);
      break;
    case Verdict::pass_nonstrict:
      all += fmt::format("      <system-out>pass-nonstrict: {}</system-out>\n", reason);
      break;
    case Verdict::pass:
      break;
  }
  return all + "    </testcase>\n";
}

std::string tc8_lines(const Tc8Row& row) {
  return fmt::format("{}: {}\n    sent: {}\n    expected: {}\n", row.id, row.title, row.stimulus,
                     row.expected);
}

}  // namespace

const char* colour_of(Verdict verdict, const cli::Colours& colours) noexcept {
  switch (verdict) {
    case Verdict::pass:
    case Verdict::pass_nonstrict:
      return colours.green;
    case Verdict::fail:
    case Verdict::error:
      return colours.red;
    case Verdict::inconclusive:
      return colours.yellow;
    case Verdict::unsupported:
      return colours.dim;
  }
  return "";
}

std::string group_of(const std::string& id) {
  return id.substr(0, id.find('.', id.find('.') + 1));
}

std::string area_of(const std::string& id) {
  return id.substr(0, id.find('.'));
}

std::string explanation(const Tc8Row& row) {
  return fmt::format("{}    no case: {}\n", tc8_lines(row), row.why_no_case);
}

std::string explanation(const RequirementRow& row, const std::vector<Case>& rules) {
  std::string all = fmt::format("{}: {}\n", row.id, row.summary);
  for (const Case& rule : rules) {
    if (chosen(rule, row.id)) {
      all += fmt::format("    rule of replay: {}, {}\n", rule.id, rule.title);
    }
  }
  all += row.why_no_rule.empty() ? "" : fmt::format("    no rule of replay: {}\n", row.why_no_rule);
  return all + (why_no_case(row).empty() ? "" : fmt::format("    no case: {}\n", why_no_case(row)));
}

std::string why_no_case(const RequirementRow& row) {
  return row.testable == "no" ? "it explains, or tells people what to do: there is nothing to test"
                              : row.why_no_case;
}

std::string case_text(const CaseResult& result, const RunInfo& info, const cli::Colours& colours) {
  const Case& one = *result.what;
  std::string all = fmt::format("{}{:>14}{}  {}  {}{}{}", colour_of(result.outcome.verdict, colours),
                                to_string(result.outcome.verdict), colours.off, one.id, colours.dim,
                                one.title, colours.off);
  if (result.outcome.reason.empty()) {
    return result.outcome.retries == 0
               ? all
               : all + fmt::format("\n{:>16}{}it {}{}", "", colours.dim, result.outcome.retried, colours.off);
  }
  all += fmt::format("\n{:>16}{}", "", result.outcome.reason);
  if (result.outcome.verdict == Verdict::fail || result.outcome.verdict == Verdict::error) {
    if (result.outcome.differences.size() > 1) {
      all += "\n" + difference_lines(result.outcome, "                ");
      all.pop_back();
    }
    for (const RequirementId& id : one.requirements) {
      if (const RequirementRow* row = find_requirement(id.text())) {
        all += fmt::format("\n{:>16}{}{}: {}{}", "", colours.dim, row->id, row->summary, colours.off);
      }
    }
    all += fmt::format("\n{:>16}{}evidence: {}{}", "", colours.dim, capture(result, info), colours.off);
    all += fmt::format("\n{:>16}{}again:    {}{}", "", colours.dim, again(one, info), colours.off);
  }
  return all;
}

std::string explanation(const Case& one) {
  std::string all = fmt::format("{}\n  The device {}.\n  level {}, role {}, at most {:.0f} s\n", one.id,
                                one.title, to_string(one.level), to_string(one.role),
                                std::chrono::duration<double>(one.budget).count());
  for (const std::string& reason : reasons_of(one.needs)) {
    all += fmt::format("  unsupported where: {}\n", reason);
  }
  for (const RequirementId& id : one.requirements) {
    const RequirementRow* row = find_requirement(id.text());
    all += fmt::format("  {}: {}\n", id.text(), row == nullptr ? "" : row->summary);
  }
  for (const Tc8Id& id : one.tc8) {
    if (const Tc8Row* row = find_tc8(id.text())) {
      all += "  " + tc8_lines(*row);
    }
  }
  return all;
}

std::string summary(const RunResult& run, const cli::Colours& colours) {
  std::string all = fmt::format("{} case{} in {:.1f} s:", run.cases.size(), run.cases.size() == 1 ? "" : "s",
                                static_cast<double>(run.took.count()) / 1000);
  for (const Verdict verdict : all_verdicts) {
    if (const std::size_t count = run.count(verdict); count > 0) {
      all += fmt::format(" {}{} {}{}", colour_of(verdict, colours), count, to_string(verdict), colours.off);
    }
  }
  return all + (run.cancelled ? "; ended before all of them were run" : "");
}

std::string junit_xml(const RunResult& run, const RunInfo& info) {
  std::map<std::string, std::vector<const CaseResult*>> areas;
  for (const CaseResult& one : run.cases) {
    areas[area_of(one.what->id)].push_back(&one);
  }
  std::string all = fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\">\n",
                                documents::xml_text("trestle conform: " + info.device));
  for (const auto& [area, cases] : areas) {
    std::string body;
    std::map<Verdict, std::size_t> counts;
    double seconds = 0;
    for (const CaseResult* one : cases) {
      body += junit_case(*one, info);
      ++counts[one->outcome.verdict];
      seconds += static_cast<double>(one->took.count()) / 1000;
    }
    all += fmt::format(
        "  <testsuite name=\"{}\" timestamp=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" "
        "time=\"{:.3f}\">\n{}  </testsuite>\n",
        area, run.started, cases.size(), counts[Verdict::fail],
        counts[Verdict::error] + counts[Verdict::inconclusive], counts[Verdict::unsupported], seconds, body);
  }
  return all + "</testsuites>\n";
}

std::string results_json(const RunResult& run, const RunInfo& info) {
  using Json = nlohmann::ordered_json;
  Json counts = Json::object();
  for (const Verdict verdict : all_verdicts) {
    counts[to_string(verdict)] = run.count(verdict);
  }
  Json cases = Json::array();
  for (const CaseResult& result : run.cases) {
    const Case& one = *result.what;
    Json differences = Json::array();
    for (const Difference& difference : result.outcome.differences) {
      differences.push_back({{"field", difference.field},
                             {"expected", difference.expected},
                             {"actual", difference.actual},
                             {"packet", difference.packet}});
    }
    Json requirements = Json::array();
    for (const RequirementId& id : one.requirements) {
      requirements.push_back(id.text());
    }
    Json tc8 = Json::array();
    for (const Tc8Id& id : one.tc8) {
      tc8.push_back(id.text());
    }
    cases.push_back({{"id", one.id},
                     {"title", one.title},
                     {"level", to_string(one.level)},
                     {"role", to_string(one.role)},
                     {"requirements", requirements},
                     {"tc8", tc8},
                     {"verdict", to_string(result.outcome.verdict)},
                     {"reason", result.outcome.reason},
                     {"differences", differences},
                     {"attempts", result.attempts},
                     {"retries", result.outcome.retries},
                     {"retried", result.outcome.retried},
                     {"milliseconds", result.took.count()},
                     {"evidence", result.evidence},
                     {"again", again(one, info)}});
  }
  const Json document{{"schema", results_schema},
                      {"device", {{"name", info.device}, {"version", info.device_version}}},
                      {"profile", info.profile_file},
                      {"level", to_string(info.level)},
                      {"seed", info.seed},
                      {"started", run.started},
                      {"cancelled", run.cancelled},
                      {"milliseconds", run.took.count()},
                      {"verdicts", counts},
                      {"cases", cases}};
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace trestle::conform
