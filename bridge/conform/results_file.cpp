#include "bridge/conform/results_file.hpp"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bridge/conform/report.hpp"

namespace trestle::conform {
namespace {

/// A run of all cases has a quarter of a megabyte.
constexpr std::size_t max_bytes = std::size_t{16} << 20U;

/// A text of an object; empty: there is none.
std::string text_of(const nlohmann::json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string{};
}

}  // namespace

std::optional<Verdict> verdict_of(std::string_view word) noexcept {
  for (const Verdict verdict : all_verdicts) {
    if (word == to_string(verdict)) {
      return verdict;
    }
  }
  return std::nullopt;
}

tl::expected<ReadRun, std::string> parse_results(const std::string& text, const std::string& file) {
  const auto wrong = [&](const std::string& what) { return tl::unexpected{file + ": " + what}; };
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("schema") || !json.contains("cases") || !json["cases"].is_array()) {
    return wrong("expected the results.json of 'trestle conform run'");
  }
  if (!json["schema"].is_number_integer() || json["schema"].get<std::int64_t>() != results_schema) {
    return wrong("has schema " + json["schema"].dump() + ", expected " + std::to_string(results_schema));
  }
  const nlohmann::json device = json.value("device", nlohmann::json::object());
  ReadRun run{.name = text_of(device, "name"),
              .version = text_of(device, "version"),
              .started = text_of(json, "started"),
              .cancelled = json.contains("cancelled") && json["cancelled"] == true};
  for (const nlohmann::json& one : json["cases"]) {
    const std::string id = text_of(one, "id");
    const std::string word = text_of(one, "verdict");
    const auto verdict = verdict_of(word);
    if (id.empty() || !verdict) {
      return wrong("a case has the id '" + id + "' and the verdict '" + word + "', expected others");
    }
    run.cases[id] = {.title = text_of(one, "title"), .verdict = *verdict, .reason = text_of(one, "reason")};
  }
  return run;
}

tl::expected<ReadRun, std::string> read_results(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const std::string file = fs::is_directory(path, error) ? (fs::path{path} / "results.json").string() : path;
  std::ifstream in{file, std::ios::binary};
  std::string text(max_bytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (!in.eof() || text.empty()) {
    return tl::unexpected{file + (text.size() > max_bytes ? ": is too large" : ": cannot be read")};
  }
  return parse_results(text, file);
}

}  // namespace trestle::conform
