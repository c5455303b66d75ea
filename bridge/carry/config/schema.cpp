#include "bridge/carry/config/schema.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/carry/config/ask_keys.hpp"
#include "bridge/documents/section.hpp"

// The loaders are the only list of keys. They are asked with small documents, one mapping at a time: once
// with the mapping empty; then with each of its words, numbers, lists and mappings alone in it, as some keys
// are there, or must be, only beside others.
namespace trestle::carry {
namespace {

using documents::AskedKey;
using documents::Shape;
using Json = nlohmann::ordered_json;
using Kind = AskedKey::Kind;

/// A name where the user chooses them; good as that of a type, too.
constexpr const char* any_name = "any_msgs/msg/Any";

/// How the documents come to a mapping.
struct Way {
  std::string before;  ///< what stands in front of it
  std::string behind;
  [[nodiscard]] Way to(const std::string& entries, const AskedKey& key) const {
    const bool is_list = key.kind == Kind::mappings;
    return {before + "{" + entries + key.name + ": " + (is_list ? "[" : ""), (is_list ? "]}" : "}") + behind};
  }
};

/// What a mapping was asked for, and whether it had to have it.
using Asked = std::map<std::string, bool>;

/// What one entry in it changes.
struct Beside {
  std::string key;
  std::string value;
  bool is_word = false;  ///< otherwise any value does the same
  Asked asked{};
};

bool holds_mappings(const AskedKey& key) {
  return key.kind == Kind::mapping || key.kind == Kind::mappings;
}

/// Takes in what else was learnt of a key.
void merge(AskedKey& known, const AskedKey& more) {
  known.kind = known.kind == Kind::mapping && !holds_mappings(more) ? more.kind : known.kind;
  for (const std::string& word : more.shape.words) {
    if (std::ranges::find(known.shape.words, word) == known.shape.words.end()) {
      known.shape.words.push_back(word);
    }
  }
  known.shape.min = std::min(known.shape.min, more.shape.min);
  known.shape.max = std::max(known.shape.max, more.shape.max);
  if (more.expected.size() > known.expected.size()) {  // "..., or any"
    known.expected = more.expected;
  }
}

/// All that a mapping may have.
class Mapping {
 public:
  explicit Mapping(Way way) : way_{std::move(way)} { learn(); }

  [[nodiscard]] const Way& way() const noexcept { return way_; }
  [[nodiscard]] bool has_any_name() const noexcept { return any_name_; }
  [[nodiscard]] const std::map<std::string, AskedKey>& keys() const noexcept { return keys_; }
  [[nodiscard]] const Asked& empty() const noexcept { return empty_; }
  [[nodiscard]] const std::vector<Beside>& beside() const noexcept { return beside_; }
  /// The entries beside which a key is asked for; none where it always is.
  [[nodiscard]] std::vector<Beside> needed_by(const std::string& key) const {
    std::vector<Beside> needed;
    if (!empty_.contains(key)) {
      std::ranges::copy_if(beside_, std::back_inserter(needed),
                           [&](const Beside& one) { return one.key != key && one.asked.contains(key); });
    }
    return needed;
  }

 private:
  Asked ask(const std::string& entries) {
    Asked asked;
    const documents::Mark here{1, static_cast<int>(way_.before.size()) + 1};
    ask_keys(way_.before + "{" + entries + "}" + way_.behind,
             [&](documents::Mark mapping, const AskedKey& key) {
               if (mapping != here) {
                 return;
               }
               if (key.kind == Kind::any_name) {
                 any_name_ = true;
                 return;
               }
               asked[key.name] = asked[key.name] || key.required;
               const auto [known, is_new] = keys_.try_emplace(key.name, key);
               if (!is_new) {
                 merge(known->second, key);
               }
             });
    return asked;
  }

  void learn() {
    empty_ = ask("");
    if (any_name_) {
      static_cast<void>(ask(std::string{any_name} + ": {}"));
      return;
    }
    std::set<std::pair<std::string, std::string>> tried;
    for (bool more = true; more;) {
      more = false;
      for (const auto& [name, key] : std::map{keys_}) {
        const bool has_words = key.kind == Kind::value && key.shape.kind == Shape::Kind::words;
        for (const std::string& value : has_words ? key.shape.words : sample(key)) {
          if (tried.emplace(name, value).second) {
            beside_.push_back({name, value, has_words, ask(name + ": " + value)});
            more = true;
          }
        }
      }
    }
  }

  /// A value to try; none where no value is known to be good.
  static std::vector<std::string> sample(const AskedKey& key) {
    if (holds_mappings(key)) {
      return {key.kind == Kind::mapping ? "{}" : "[{}]"};
    }
    if (key.kind == Kind::value && key.shape.kind == Shape::Kind::number) {
      return {std::to_string(key.shape.min)};
    }
    return {};
  }

  Way way_;
  bool any_name_ = false;
  std::map<std::string, AskedKey> keys_;
  Asked empty_;
  std::vector<Beside> beside_;
};

Json text(const std::string& pattern) {
  return {{"type", "string"}, {"pattern", pattern}};
}

/// A scalar: YAML takes plain ones for numbers and the like, and the program reads their text.
Json schema_of(const Shape& shape) {
  constexpr const char* quantity = "([0-9]+\\.?[0-9]*|\\.[0-9]+) *";
  Json forms = Json::array();
  switch (shape.kind) {
    case Shape::Kind::text:
      if (!shape.pattern.empty()) {
        return text(shape.pattern);
      }
      return {{"type", {"string", "number", "boolean"}}};
    case Shape::Kind::words:
      break;
    case Shape::Kind::number:
      forms.push_back({{"type", "integer"}, {"minimum", shape.min}, {"maximum", shape.max}});
      forms.push_back(text("^(0[xX][0-9a-fA-F]+|0|[1-9][0-9]*)$"));
      break;
    case Shape::Kind::time:
      if (shape.min == 0) {
        forms.push_back({{"const", 0}});
      }
      forms.push_back(text("^(" + std::string{shape.min == 0 ? "0|" : ""} + quantity + "(ns|us|ms|s))$"));
      break;
    case Shape::Kind::size:
      forms.push_back({{"type", "integer"}, {"minimum", shape.min}, {"maximum", shape.max}});
      forms.push_back(text("^(0[xX][0-9a-fA-F]+|0|[1-9][0-9]*|" + std::string{quantity} + "(B|KiB|MiB))$"));
      break;
  }
  Json words = Json::array();
  for (const std::string& word : shape.words) {
    words.push_back(word);
    if (word == "true" || word == "false") {
      words.push_back(word == "true");
    } else if (word.find_first_not_of("0123456789") == std::string::npos) {
      words.push_back(std::stoi(word));
    }
  }
  if (!words.empty()) {
    forms.push_back({{"enum", words}});
  }
  return forms.size() == 1 ? forms[0] : Json{{"anyOf", forms}};
}

Json required(const std::set<std::string>& keys) {
  return {{"required", keys}};
}

/// What must be there, whatever else is: `all_of` gets what depends on other entries.
std::set<std::string> required_keys(const Mapping& mapping, Json& all_of) {
  std::set<std::string> always;
  for (const auto& [name, is_required] : mapping.empty()) {
    if (!is_required) {
      continue;
    }
    Json instead = Json::array({required({name})});
    for (const Beside& one : mapping.beside()) {
      const auto here = one.asked.find(name);
      if (one.key != name && !one.is_word && here != one.asked.end() && !here->second) {
        instead.push_back(required({one.key}));
      }
    }
    if (instead.size() == 1) {
      always.insert(name);
    } else {
      all_of.push_back({{"anyOf", instead}});
    }
  }
  return always;
}

/// Whether an entry is there.
Json is_there(const Beside& one) {
  Json condition = required({one.key});
  if (one.is_word) {
    condition["properties"] = {{one.key, schema_of({.kind = Shape::Kind::words, .words = {one.value}})}};
  }
  return condition;
}

/// What an entry asks for, and what may only be there beside others.
void add_conditions(const Mapping& mapping, Json& all_of) {
  for (const Beside& one : mapping.beside()) {
    std::set<std::string> needed;
    for (const auto& [name, is_required] : one.asked) {
      const auto otherwise = mapping.empty().find(name);
      if (is_required && (otherwise == mapping.empty().end() || !otherwise->second)) {
        needed.insert(name);
      }
    }
    if (!needed.empty()) {
      all_of.push_back({{"if", is_there(one)}, {"then", required(needed)}});
    }
  }
  for (const auto& [name, key] : mapping.keys()) {
    Json others = Json::array();
    for (const Beside& one : mapping.needed_by(name)) {
      others.push_back(is_there(one));
    }
    if (!others.empty()) {
      all_of.push_back({{"if", required({name})}, {"then", {{"anyOf", others}}}});
    }
  }
}

/// Makes the schema of each mapping, and puts what comes several times into "definitions".
class Maker {
 public:
  Json make() {
    Json root = schema_of(Mapping{Way{}}, 0);
    Json& keys = root["properties"];
    // These are used before the loaders see the file: load_interfaces.cpp.
    keys["interfaces"] = list_of({{"type", "string"}, {"minLength", 1}});
    keys["interfaces"]["minItems"] = 1;
    keys["generate"] = {{"anyOf", {{{"const", "all"}}, keys["generate"]}}};
    for (const char* list : {"routes", "methods", "fields"}) {
      let_name_a_member(keys[list]["items"]);
      Json names_a_member = required({list});
      names_a_member["properties"][list]["contains"] = required({"someip"});
      root["allOf"].push_back({{"if", names_a_member}, {"then", required({"interfaces"})}});
    }
    Json schema{{"$schema", "http://json-schema.org/draft-07/schema#"},
                {"title", "A configuration of trestle bridge"}};
    schema.update(root);
    for (const auto& [name, definition] : definitions_) {
      schema["definitions"][name] = definition;
    }
    return schema;
  }

 private:
  static Json list_of(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

  /// With `someip: Door.moved` all that an element must have comes from the interfaces.
  static void let_name_a_member(Json& element) {
    Json otherwise = Json::object();
    for (const char* key : {"required", "allOf"}) {
      if (element.contains(key)) {
        otherwise[key] = element[key];
        element.erase(key);
      }
    }
    element["properties"]["someip"] = {
        {"type", "string"}, {"description", "SERVICE.MEMBER of the interfaces, such as Door.moved"}};
    element["if"] = {{"required", {"someip"}}};
    element["else"] = otherwise;
  }

  /// The mapping under a key. Some are looked into only beside another entry.
  static Mapping inside(const Mapping& mapping, const AskedKey& key) {
    Mapping inner{mapping.way().to("", key)};
    for (const Beside& one : mapping.beside()) {
      if (!inner.keys().empty() || inner.has_any_name()) {
        break;
      }
      if (one.key != key.name) {
        inner = Mapping{mapping.way().to(one.key + ": " + one.value + ", ", key)};
      }
    }
    return inner;
  }

  Json schema_of(const Mapping& mapping, int depth) {
    if (mapping.has_any_name()) {
      Json names{{"type", "object"}};
      if (const auto key = mapping.keys().find(any_name); key != mapping.keys().end()) {
        names["additionalProperties"] = schema_of(mapping, key->second, depth);
      }
      return names;
    }
    Json properties = Json::object();
    for (const auto& [name, key] : mapping.keys()) {
      properties[name] = schema_of(mapping, key, depth);
    }
    properties["<<"] = true;  // where a reader leaves merging to us
    Json schema{{"type", "object"}, {"properties", properties}, {"additionalProperties", false}};
    Json all_of = Json::array();
    if (const std::set<std::string> always = required_keys(mapping, all_of); !always.empty()) {
      schema["required"] = always;
    }
    add_conditions(mapping, all_of);
    if (!all_of.empty()) {
      schema["allOf"] = all_of;
    }
    return schema;
  }

  /// Of the value of a key.
  Json schema_of(const Mapping& mapping, const AskedKey& key, int depth) {
    if (!holds_mappings(key)) {
      Json value = carry::schema_of(key.shape);
      if (!key.expected.empty()) {
        value["description"] = key.expected;
      }
      return key.kind == Kind::values ? list_of(std::move(value)) : value;
    }
    const Mapping inner = inside(mapping, key);
    Json schema = schema_of(inner, depth + 1);
    if (key.kind == Kind::mapping) {
      // A mapping of the root comes once, and its name says the most where it stands.
      return depth == 0 ? schema : defined(key.name == any_name ? "named" : key.name, std::move(schema));
    }
    Json list = list_of(std::move(schema));
    list["minItems"] = 1;
    return list;
  }

  Json defined(const std::string& name, Json schema) {
    std::string unique = name;
    for (int number = 2;; ++number) {
      const auto [at, is_new] = definitions_.try_emplace(unique, schema);
      if (is_new || at->second == schema) {
        return {{"$ref", "#/definitions/" + unique}};
      }
      unique = name + "_" + std::to_string(number);
    }
  }

  std::map<std::string, Json> definitions_;
};

}  // namespace

std::string config_schema() {
  return Maker{}.make().dump(1) + "\n";
}

}  // namespace trestle::carry
