#include "bridge/conform/fuzz/fuzz_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "bridge/cli/shell_word.hpp"
#include "bridge/conform/report.hpp"
#include "bridge/documents/xml_text.hpp"
#include "bridge/messages/values/byte_text.hpp"
#include "bridge/web/assets.hpp"

namespace trestle::conform {
namespace {

using Json = nlohmann::ordered_json;

const char* way_name(Way way) {
  switch (way) {
    case Way::sd_unicast:
      return "sd";
    case Way::sd_multicast:
      return "sd multicast";
    case Way::udp:
      return "udp";
    case Way::tcp:
      return "tcp";
    case Way::tcp_close:
      return "tcp close";
  }
  return "?";
}

std::string whole_hex(ByteView bytes) {
  std::string text;
  messages::append_hex(text, bytes);
  return text;
}

double seconds_of(std::chrono::milliseconds time) {
  return std::chrono::duration<double>(time).count();
}

const char* how_sure(const Finding& finding) {
  return finding.confirmed ? "confirmed by a second run" : "seen once";
}

}  // namespace

std::string replay_command(const Finding& finding, const FuzzInfo& info) {
  return fmt::format("trestle fuzz --dut {} --replay {}", cli::shell_word(info.profile_file),
                     cli::shell_word(info.folder + "/" + finding.evidence));
}

std::string fuzz_summary(const FuzzResult& result, const FuzzInfo& info) {
  const FuzzProgress& done = result.done;
  std::string text = fmt::format(
      "{} sequences, {} messages in {:.1f} s; {} different answers{}; {} sequences kept; the device was "
      "started "
      "anew {} times\n",
      done.sequences, done.messages, seconds_of(done.since_begin), done.behaviours,
      done.places == 0 ? "" : fmt::format(", {} places of its code", done.places), result.kept,
      result.restarts);
  if (result.answer_longest.count() != 0) {
    text += fmt::format("answers took {} us (median), {} us (longest)", result.answer_median.count(),
                        result.answer_longest.count());
  }
  if (result.memory_before != 0) {
    text += fmt::format("; memory {} kB, then {} kB; descriptors {}, then {}", result.memory_before / 1024,
                        result.memory_after / 1024, result.descriptors_before, result.descriptors_after);
  }
  for (const auto& [what, count] : result.unconfirmed) {
    text += fmt::format("; {} times {}, which a second run did not show", count, what);
  }
  text += fmt::format("\n{} finding{}; report.html, results.json and a capture of each are in {}; seed {}\n",
                      result.findings.size(), result.findings.size() == 1 ? "" : "s", info.folder, info.seed);
  return text;
}

std::string fuzz_json(const FuzzResult& result, const FuzzInfo& info) {
  const FuzzProgress& done = result.done;
  Json findings = Json::array();
  for (const Finding& one : result.findings) {
    Json steps = Json::array();
    for (const Step& step : one.sequence.steps) {
      steps.push_back({{"way", way_name(step.way)},
                       {"port", step.port},
                       {"pause_ms", step.pause.count()},
                       {"counted", step.counted},
                       {"bytes", whole_hex(step.bytes)}});
    }
    findings.push_back({{"kind", to_string(one.kind)},
                        {"what", one.what},
                        {"state", one.sequence.state},
                        {"confirmed", one.confirmed},
                        {"seen", one.seen},
                        {"after_ms", one.after.count()},
                        {"steps_found", one.steps_found},
                        {"steps", steps},
                        {"evidence", one.evidence},
                        {"again", replay_command(one, info)}});
  }
  const Json all{
      {"schema", 1},
      {"device", {{"name", info.device}, {"version", info.device_version}}},
      {"profile", info.profile_file},
      {"command", info.command},
      {"seed", info.seed},
      {"started", result.started},
      {"milliseconds", done.since_begin.count()},
      {"cancelled", result.cancelled},
      {"gave_up", result.gave_up},
      {"sequences", done.sequences},
      {"messages", done.messages},
      {"states", result.states},
      {"answers", done.behaviours},
      {"code_places", done.places},
      {"kept", result.kept},
      {"restarts", result.restarts},
      {"unconfirmed", std::accumulate(result.unconfirmed.begin(), result.unconfirmed.end(), std::uint64_t{0},
                                      [](std::uint64_t sum, const auto& one) { return sum + one.second; })},
      {"unconfirmed_signs", result.unconfirmed},
      {"answer_us", {{"median", result.answer_median.count()}, {"longest", result.answer_longest.count()}}},
      {"memory", {{"before", result.memory_before}, {"after", result.memory_after}}},
      {"descriptors", {{"before", result.descriptors_before}, {"after", result.descriptors_after}}},
      {"findings", findings}};
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string fuzz_page(const FuzzResult& result, const FuzzInfo& info) {
  const auto assets = web::assets();
  const auto look = std::ranges::find(assets, std::string_view{"look.css"}, &web::Asset::name);
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width\">\n<title>trestle fuzz: {0}</title>\n"
      "<style>{1}\nmain{{max-width:70rem;margin:2rem auto;padding:0 1rem}} pre{{overflow-x:auto}} "
      "td,th{{text-align:left;padding:.15rem .8rem .15rem 0}}</style></head>\n<body><main>\n"
      "<h1>{0}</h1>\n<p>{2}, <code>{3}</code></p>\n<pre>{4}</pre>\n",
      documents::xml_text(info.device), look == assets.end() ? std::string_view{} : look->text,
      documents::xml_text(result.started), documents::xml_text(info.command),
      documents::xml_text(fuzz_summary(result, info)));
  if (!result.gave_up.empty()) {
    page += fmt::format("<p><strong>It ended early:</strong> {}</p>\n", documents::xml_text(result.gave_up));
  }
  page += "<h2>States</h2>\n<table><tr><th>state</th><th>sequences</th></tr>\n";
  for (const auto& [state, count] : result.states) {
    page += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", documents::xml_text(state), count);
  }
  page += fmt::format("</table>\n<h2>Findings: {}</h2>\n", result.findings.size());
  for (const Finding& one : result.findings) {
    page += fmt::format(
        "<details><summary><strong>{}</strong> {}</summary>\n"
        "<p>After {:.1f} s, state \"{}\"; {}; seen {} times. {} of {} steps are needed.</p>\n"
        "<p>Again: <code>{}</code>; its packets: <a href=\"{}\">{}</a></p>\n<pre>",
        to_string(one.kind), documents::xml_text(one.what), seconds_of(one.after),
        documents::xml_text(one.sequence.state), how_sure(one), one.seen, one.sequence.steps.size(),
        one.steps_found, documents::xml_text(replay_command(one, info)), documents::xml_text(one.evidence),
        documents::xml_text(one.evidence));
    for (const Step& step : one.sequence.steps) {
      page += fmt::format("{:12} {:5}  {}\n", way_name(step.way), step.port, whole_hex(step.bytes));
    }
    page += "</pre></details>\n";
  }
  return page + "</main></body></html>\n";
}

}  // namespace trestle::conform
