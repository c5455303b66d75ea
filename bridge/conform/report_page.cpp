#include "bridge/conform/report_page.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "bridge/web/assets.hpp"

namespace trestle::conform {
namespace {

using Json = nlohmann::ordered_json;

std::string_view asset(std::string_view name) {
  const auto all = web::assets();
  const auto found = std::ranges::find(all, name, &web::Asset::name);
  return found == all.end() ? std::string_view{} : found->text;
}

Json packets_json(const Timeline& timeline) {
  Json packets = Json::array();
  for (const PacketLine& one : timeline.lines) {
    packets.push_back(
        {{"number", one.number},
         {"microseconds", std::chrono::duration_cast<std::chrono::microseconds>(one.since_first).count()},
         {"sent", one.sent},
         {"transport", one.transport == Transport::tcp ? "TCP" : "UDP"},
         {"from", one.from},
         {"to", one.to},
         {"text", one.text},
         {"comment", one.comment},
         {"hex", one.hex}});
  }
  return packets;
}

/// The results, and what else the page shows: packets, and what requirements and TC8 cases say.
std::string page_data(const RunResult& run, const RunInfo& info) {
  Json data = Json::parse(results_json(run, info));
  Json tc8 = Json::object();
  for (std::size_t at = 0; at < run.cases.size(); ++at) {
    data["cases"][at]["packets"] = packets_json(run.cases[at].timeline);
    data["cases"][at]["packets_left_out"] = run.cases[at].timeline.left_out;
    for (const Tc8Id& id : run.cases[at].what->tc8) {
      if (const Tc8Row* row = find_tc8(id.text())) {
        tc8[row->id] = row->title;
      }
    }
  }
  Json rows = Json::array();
  for (const RequirementRow& row : requirements()) {
    rows.push_back({{"id", row.id},
                    {"area", row.area},
                    {"testable", row.testable},
                    {"summary", row.summary},
                    {"why_no_case", row.why_no_case}});
  }
  data["requirements"] = rows;
  data["tc8"] = tc8;
  std::string text = data.dump(-1, ' ', false, Json::error_handler_t::replace);
  // Nothing in it may end the element that it stands in, nor begin a comment.
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    safe += c == '<' ? "\\u003c" : std::string(1, c);
  }
  return safe;
}

}  // namespace

std::string report_page(const RunResult& run, const RunInfo& info) {
  const std::array<std::pair<std::string_view, std::string>, 3> parts{
      {{"{{style}}", std::string{asset("look.css")} + std::string{asset("conform/report.css")}},
       {"{{data}}", page_data(run, info)},
       {"{{script}}", std::string{asset("conform/report.js")}}}};
  std::string_view rest = asset("conform/report.html");
  std::string page;
  for (const auto& [mark, text] : parts) {  // in this order in the page
    const auto at = rest.find(mark);
    page += rest.substr(0, at);
    page += text;
    rest.remove_prefix(at == std::string_view::npos ? rest.size() : at + mark.size());
  }
  page += rest;
  return page;
}

}  // namespace trestle::conform
