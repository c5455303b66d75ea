// The public files of ../shared/corpora. All are read, or refused for a reason that is right.
#include "test/bridge/describe/fidl/corpus.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <map>
#include <random>
#include <set>
#include <sstream>

namespace trestle::describe {
namespace {

using ::testing::HasSubstr;

class Corpus : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!corpus::folder()) {
      GTEST_SKIP() << "the real files are not here";
    }
  }
};

std::string all_told(const Reading& reading) {
  std::string all;
  for (const documents::Problem& problem : reading.problems) {
    all += documents::to_string(problem) + "\n";
  }
  return all;
}

/// Why a file is refused; empty for all others.
std::string reason(const std::filesystem::path& file) {
  static const std::map<std::string, std::string> reasons{
      // CommonAPI's generators refuse them for the same reason.
      {"attranonymtc.fdepl", "has the id 0x0bc2"},
      {"attrnamedtc.fdepl", "has the id 0x0bc2"},
      {"Strings.fdepl", "has the id 0x0001"},
      // A probe: ^UInt8 within itself.
      {"N.fidl", "the types form a cycle"},
  };
  const auto found = reasons.find(file.filename().string());
  return found == reasons.end() ? "" : found->second;
}

TEST_F(Corpus, IsReadOrRefusedForARightReason) {
  for (const char* within : {"files", "probes", "deployment_specs"}) {
    for (const char* ending : {".fidl", ".fdepl"}) {
      for (const auto& file : corpus::files(within, ending)) {
        const Reading reading = corpus::read(file);
        const std::string expected = reason(file);
        if (expected.empty()) {
          EXPECT_TRUE(reading.ok()) << file << "\n" << all_told(reading);
        } else {
          EXPECT_FALSE(reading.ok()) << file;
          EXPECT_THAT(all_told(reading), HasSubstr(expected));
        }
      }
    }
  }
}

/// What a FIDL file declares, counted without a parser: words at the depth of members.
struct Counts {
  std::size_t interfaces = 0;
  std::size_t attributes = 0;
  std::size_t methods = 0;
  std::size_t broadcasts = 0;
  std::size_t types = 0;
  friend bool operator==(const Counts&, const Counts&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Counts& counts) {
    return out << counts.interfaces << " interfaces " << counts.attributes << " attributes " << counts.methods
               << " methods " << counts.broadcasts << " broadcasts " << counts.types << " types";
  }
};

Counts counted(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t at = 0; at < text.size();) {
    const auto to = [&](const char* end, std::size_t from) {
      const std::size_t found = text.find(end, from);
      return found == std::string::npos ? text.size() : found + std::string_view{end}.size();
    };
    if (text.compare(at, 2, "//") == 0) {
      at = to("\n", at);
    } else if (text.compare(at, 2, "/*") == 0) {
      at = to("*/", at + 2);
    } else if (text.compare(at, 3, "<**") == 0) {
      at = to("**>", at);
    } else if (text[at] == '"') {
      at = to("\"", at + 1);
    } else if (std::isalnum(static_cast<unsigned char>(text[at])) != 0 || text[at] == '_' ||
               text[at] == '^') {
      std::size_t end = at;
      while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 ||
                                   text[end] == '_' || text[end] == '^')) {
        ++end;
      }
      words.push_back(text.substr(at, end - at));
      at = end;
    } else {
      words.emplace_back(1, text[at++]);
    }
  }
  Counts counts;
  int depth = 0;
  static const std::set<std::string> types{"struct", "union", "enumeration", "array", "map", "typedef"};
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    depth += word == "{" ? 1 : word == "}" ? -1 : 0;
    counts.interfaces += depth == 0 && word == "interface" ? 1 : 0;
    if (depth == 1) {
      counts.attributes += word == "attribute" ? 1 : 0;
      counts.methods += word == "method" ? 1 : 0;
      counts.broadcasts += word == "broadcast" ? 1 : 0;
      counts.types += types.contains(word) ? 1 : 0;
    }
  }
  return counts;
}

TEST_F(Corpus, HasAsMuchInItAsAnIndependentCountFinds) {
  std::size_t compared = 0;
  for (const auto& file : corpus::files("files", ".fidl")) {
    const SourceText source{file.string(), corpus::text_of(file).value()};
    const Reading reading = read_fidl(std::span{&source, 1}, corpus::load);
    Counts expected;
    for (const std::string& name : reading.model.files) {  // with its imports
      const Counts one = counted(corpus::text_of(name).value());
      expected = {expected.interfaces + one.interfaces, expected.attributes + one.attributes,
                  expected.methods + one.methods, expected.broadcasts + one.broadcasts,
                  expected.types + one.types};
    }
    Counts counts;
    std::map<std::string, const Service*> services;
    for (const Service& service : reading.model.services) {
      services[full_name(service.scope, service.name)] = &service;
    }
    for (const Service& service : reading.model.services) {
      ++counts.interfaces;
      const Service* base = service.base.empty() ? nullptr : services.at(service.base);
      counts.attributes += service.fields.size() - (base == nullptr ? 0 : base->fields.size());
      counts.methods += service.methods.size() - (base == nullptr ? 0 : base->methods.size());
      counts.broadcasts += service.events.size() - (base == nullptr ? 0 : base->events.size());
    }
    for (const Type& type : reading.model.types) {
      counts.types += !type.name.empty() && type.variant_of == no_type ? 1 : 0;
    }
    EXPECT_EQ(counts, expected) << file;
    ++compared;
  }
  EXPECT_GT(compared, 20u);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> parts{""};
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      parts.emplace_back();
    } else if (c != '\r') {
      parts.back() += c;
    }
  }
  return parts;
}

/// The numbers of a use as CommonAPI's generators write them.
std::string numbers(const Model& model, const Type& type, const Wire& wire) {
  const auto width = [](someip::FieldWidth width) { return static_cast<int>(width); };
  switch (type.kind) {
    case Kind::string:
      return fmt::format("{} {} {}",
                         wire.length == someip::FieldWidth::none ? wire.fixed_bytes : type.max_size,
                         width(wire.length),
                         wire.encoding == someip::StringEncoding::utf8      ? "UTF8"
                         : wire.encoding == someip::StringEncoding::utf16le ? "UTF16LE"
                                                                            : "UTF16BE");
    case Kind::array:
    case Kind::map:
    case Kind::bytes:
      // A fixed size is the least and the most; CommonAPI leaves the least at 0 where it is not given.
      return fmt::format("{} {} {}", type.fixed_size ? 0 : type.min_size, type.max_size, width(wire.length));
    case Kind::structure:
      return fmt::format("{}", width(wire.length));
    case Kind::choice:
      return fmt::format("{} {} {} {}", width(wire.length), width(wire.selector), wire.length_first,
                         wire.fixed_bytes);
    case Kind::enumeration: {
      const int bits = wire.bits == 0 ? messages::width(type.primitive) * 8 : wire.bits;
      const bool is_signed = std::string{to_string(type.primitive)}.starts_with("int");
      return fmt::format("{} {}", bits, is_signed);
    }
    case Kind::alias:
      return numbers(model, resolved(model, type.element.type), type.element.wire);
    case Kind::primitive:
      break;
  }
  return "";
}

/// The numbers of an element "foo_x2", "tStruct_member", "my_string", "tStruct" of an interface or
/// collection.
std::string effective(const Model& model, const std::string& scope, const std::string& element) {
  const auto of = [&](const Value& value) { return numbers(model, resolved(model, value.type), value.wire); };
  for (const Service& service : model.services) {
    if (full_name(service.scope, service.name) != scope) {
      continue;
    }
    for (const Field& field : service.fields) {
      if (field.name == element) {
        return of(field.payload.values.at(0));
      }
    }
    for (const Method& method : service.methods) {
      for (const Payload* payload : {&method.request, &method.response}) {
        for (const Value& value : payload->values) {
          if (method.name + "_" + value.name == element) {
            return of(value);
          }
        }
      }
    }
    for (const Event& event : service.events) {
      for (const Value& value : event.payload.values) {
        if (event.name + "_" + value.name == element) {
          return of(value);
        }
      }
    }
  }
  for (const Type& type : model.types) {
    if (type.scope != scope || type.variant_of != no_type) {
      continue;
    }
    if (type.name == element) {
      return numbers(model, type, type.wire);
    }
    for (const Value& member : type.members) {
      if (type.name + "_" + member.name == element) {
        return of(member);
      }
    }
  }
  return "not there";
}

/// Without exceptions: no row is of a file with the overwrites that CommonAPI 3.2.15 ignores.
TEST_F(Corpus, HasTheNumbersOfCommonApisGenerators) {
  std::istringstream table{corpus::text_of(*corpus::folder() / "commonapi_effective.csv").value()};
  std::string line;
  std::getline(table, line);
  std::size_t rows = 0;
  std::map<std::string, Reading> readings;
  while (std::getline(table, line)) {
    const std::vector<std::string> row = split(line);
    ASSERT_GE(row.size(), 7u) << line;
    std::string repository = row[0];
    repository.replace(repository.find('/'), 1, "+");
    const auto file = *corpus::folder() / "files" / (repository + "@" + row[1].substr(0, 8)) / row[2];
    auto& reading = readings.try_emplace(file.string()).first->second;
    if (reading.model.files.empty()) {
      reading = corpus::read(file);
    }
    // "v1.commonapi.examples.E03Methods"; an anonymous collection is "a.b.a_b__Types", a named one as it is.
    std::string scope = row[3];
    if (scope.size() > 2 && scope[0] == 'v' && std::isdigit(static_cast<unsigned char>(scope[1])) != 0) {
      scope.erase(0, scope.find('.') + 1);
    }
    if (scope.ends_with("__Types")) {
      scope.erase(scope.rfind('.'));
    }
    ++rows;
    EXPECT_EQ(effective(reading.model, scope, row[4]), row[6]) << line;
  }
  EXPECT_GT(rows, 50u);
}

/// One change of a text: a token cut out, doubled, or named otherwise, or the end cut off.
std::string mutated(const std::string& text, std::mt19937& random) {
  std::vector<std::pair<std::size_t, std::size_t>> tokens;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = at + 1;
    while (std::isalnum(static_cast<unsigned char>(text[at])) != 0 && end < text.size() &&
           std::isalnum(static_cast<unsigned char>(text[end])) != 0) {
      ++end;
    }
    if (std::isspace(static_cast<unsigned char>(text[at])) == 0) {
      tokens.emplace_back(at, end - at);
    }
    at = end;
  }
  if (tokens.empty()) {
    return text;
  }
  const auto [at, length] = tokens[random() % tokens.size()];
  switch (random() % 5) {
    case 0:
      return text.substr(0, at) + text.substr(at + length);
    case 1:
      return text.substr(0, at) + text.substr(at, length) + " " + text.substr(at);
    case 2:
      return text.substr(0, at) + "renamed" + text.substr(at + length);
    case 3:
      return text.substr(0, at);
    default: {
      const auto [from, bytes] = tokens[random() % tokens.size()];
      return text.substr(0, at) + text.substr(from, bytes) + text.substr(at + length);
    }
  }
}

TEST_F(Corpus, GivesErrorsWithPlacesWhenItIsDamaged) {
  constexpr unsigned seed = 25;
  std::mt19937 random{seed};
  std::size_t refused = 0;
  for (const char* ending : {".fidl", ".fdepl"}) {
    for (const auto& file : corpus::files("files", ending)) {
      const std::string text = corpus::text_of(file).value();
      for (int round = 0; round < 15; ++round) {
        const SourceText source{file.string(), mutated(text, random)};
        const Reading reading = read_fidl(std::span{&source, 1}, corpus::load);
        ASSERT_LE(reading.problems.size(), 100u);
        refused += reading.ok() ? 0 : 1;
        for (const documents::Problem& problem : reading.problems) {
          EXPECT_FALSE(problem.text.empty());
          EXPECT_FALSE(problem.file.empty());
          EXPECT_TRUE(problem.mark.line > 0 || problem.severity == documents::Problem::Severity::warning)
              << documents::to_string(problem) << "\nseed " << seed << " round " << round;
        }
      }
    }
  }
  EXPECT_GT(refused, 100u);
}

}  // namespace
}  // namespace trestle::describe
