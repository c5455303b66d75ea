#include "bridge/conform/catalogue.hpp"

#include <vector>

namespace trestle::conform {
namespace {

/// The fields of the next row, and `text` without it. Fields may be in quotes, in which "" is a quote.
std::vector<std::string> take_row(std::string_view& text) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  std::size_t at = 0;
  for (; at < text.size() && (quoted || text[at] != '\n'); ++at) {
    const char c = text[at];
    if (c == '"' && quoted && at + 1 < text.size() && text[at + 1] == '"') {
      fields.back() += c;
      ++at;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  text.remove_prefix(std::min(at + 1, text.size()));
  return fields;
}

template <typename Row, typename Make>
std::vector<Row> read_table(std::string_view text, std::size_t columns, Make make) {
  std::vector<Row> rows;
  take_row(text);  // the names of the columns
  while (!text.empty()) {
    std::vector<std::string> fields = take_row(text);
    fields.resize(columns);
    rows.push_back(make(fields));
  }
  return rows;
}

template <typename Row>
const Row* find(std::span<const Row> rows, std::string_view id) {
  const auto found = std::ranges::find(rows, id, &Row::id);
  return found == rows.end() ? nullptr : &*found;
}

struct Reason {
  std::string id;
  std::string why;
};

std::vector<Reason> read_reasons(std::string_view text) {
  return read_table<Reason>(text, 2, [](std::vector<std::string>& fields) {
    return Reason{fields[0], fields[1]};
  });
}

std::string reason_of(std::span<const Reason> reasons, std::string_view id) {
  const Reason* why = find(reasons, id);
  return why == nullptr ? std::string{} : why->why;
}

}  // namespace

std::span<const RequirementRow> requirements() {
  static const std::vector<RequirementRow> rows = [] {
    const std::vector<Reason> no_rule = read_reasons(no_rule_csv());
    const std::vector<Reason> no_case = read_reasons(no_case_csv());
    return read_table<RequirementRow>(requirements_csv(), 5, [&](std::vector<std::string>& fields) {
      return RequirementRow{fields[0],
                            fields[1],
                            fields[2],
                            fields[3],
                            fields[4],
                            reason_of(no_rule, fields[0]),
                            reason_of(no_case, fields[0])};
    });
  }();
  return rows;
}

const RequirementRow* find_requirement(std::string_view id) {
  return find(requirements(), id);
}

std::span<const Tc8Row> tc8_cases() {
  static const std::vector<Tc8Row> rows =
      read_table<Tc8Row>(tc8_csv(), 5, [](std::vector<std::string>& fields) {
        return Tc8Row{fields[0], fields[1], fields[2], fields[3], fields[4]};
      });
  return rows;
}

const Tc8Row* find_tc8(std::string_view id) {
  return find(tc8_cases(), id);
}

}  // namespace trestle::conform
