#include "bridge/describe/read/fidl/keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

/// Where a key may stand: N instance, P provider, I interface, A attribute, M method, B broadcast, a
/// argument, r array, s struct, u union, e enumeration, n enumerator, t string, b byte buffer, i integer, f
/// struct field, g union field.
struct Key {
  std::string_view hosts;
  int versions;  ///< 1, 2, 3: both; 0: of none, but people write it
};

using Table = std::map<std::string, Key, std::less<>>;

Table make_table() {
  Table table;
  const auto add = [&](std::string_view hosts, int versions, std::initializer_list<const char*> names) {
    for (const char* name : names) {
      Key& key = table.try_emplace(name, Key{hosts, 0}).first->second;
      key.versions |= versions;
    }
  };
  add("N", 3,
      {"SomeIpInstanceID", "SomeIpUnicastAddress", "SomeIpReliableUnicastPort", "SomeIpUnreliableUnicastPort",
       "SomeIpMulticastEventGroups", "SomeIpMulticastAddresses", "SomeIpMulticastPorts",
       "SomeIpDefaultErrorCoding", "Domain", "InstanceId", "PreregisteredProperties"});
  add("N", 2, {"SomeIpMulticastThreshold", "Variant", "Year"});
  add("N", 1, {"CodeArtifactName"});
  add("N", 0, {"SomeIpUnicastPort"});
  add("P", 1, {"ClientInstanceReferences", "ProjectVariants"});
  add("IN", 3, {"DefaultTimeout"});
  add("I", 1, {"DefaultEnumBackingType"});
  add("I", 3, {"SomeIpServiceID"});
  add("IAB", 3, {"SomeIpEventGroups"});
  add("A", 3,
      {"SomeIpGetterID", "SomeIpSetterID", "SomeIpNotifierID", "SomeIpAttributeEndianess",
       "SomeIpAttributeCRCWidth"});
  add("A", 2,
      {"SomeIpAttributeReliable",
       "SomeIpNotifierEventGroups",
       "SomeIpGetterMaxRetentionTime",
       "SomeIpSetterMaxRetentionTime",
       "SomeIpNotifierMaxRetentionTime",
       "SomeIpGetterResponseMaxRetentionTime",
       "SomeIpSetterResponseMaxRetentionTime",
       "SomeIpGetterRequestDebounceTime",
       "SomeIpSetterRequestDebounceTime",
       "SomeIpNotifierDebounceTime",
       "SomeIpGetterResponseDebounceTime",
       "SomeIpSetterResponseDebounceTime",
       "SomeIpSetterSegmentLength",
       "SomeIpSetterSeparationTime",
       "SomeIpGetterSegmentLengthResponse",
       "SomeIpGetterSeparationTimeResponse",
       "SomeIpNotifierSegmentLength",
       "SomeIpNotifierSeparationTime",
       "AttributeSetterTimeout",
       "AttributeGetterTimeout",
       "AttributeNotifierTimeout",
       "AttributeNotifierUpdateMode"});
  add("A", 1,
      {"SomeIpGetterReliable", "SomeIpSetterReliable", "SomeIpNotifierReliable", "SomeIpGetterPriority",
       "SomeIpSetterPriority", "SomeIpNotifierPriority", "SomeIpNotifierMulticast"});
  add("AM", 1, {"Timeout"});
  add("MB", 3, {"SomeIpReliable"});
  add("MB", 1, {"SomeIpPriority"});
  add("M", 3,
      {"SomeIpMethodID", "SomeIpMethodEndianess", "SomeIpMethodCRCWidth", "SomeIpErrorCoding", "Errors"});
  add("M", 2,
      {"SomeIpMethodMaxRetentionTime", "SomeIpMethodResponseMaxRetentionTime",
       "SomeIpMethodRequestDebounceTime", "SomeIpMethodResponseDebounceTime", "SomeIpMethodSegmentLength",
       "SomeIpMethodSeparationTime", "SomeIpMethodSegmentLengthResponse",
       "SomeIpMethodSeparationTimeResponse", "MethodTimeout"});
  add("B", 3,
      {"SomeIpEventID", "SomeIpBroadcastEndianess", "SomeIpBroadcastCRCWidth", "BroadcastType", "ErrorName"});
  add("B", 1, {"SomeIpMulticast"});
  add("B", 2,
      {"SomeIpBroadcastMaxRetentionTime", "SomeIpBroadcastDebounceTime", "SomeIpBroadcastSegmentLength",
       "SomeIpBroadcastSeparationTime"});
  add("r", 3, {"SomeIpArrayMinLength", "SomeIpArrayMaxLength", "SomeIpArrayLengthWidth"});
  add("u", 3,
      {"SomeIpUnionLengthWidth", "SomeIpUnionTypeWidth", "SomeIpUnionDefaultOrder", "SomeIpUnionMaxLength"});
  add("s", 3, {"SomeIpStructLengthWidth"});
  add("e", 3, {"SomeIpEnumWidth", "SomeIpEnumBitWidth", "SomeIpEnumInvalidValue", "EnumBackingType"});
  add("en", 3, {"ErrorType"});
  add("t", 3, {"SomeIpStringLength", "SomeIpStringLengthWidth", "SomeIpStringEncoding"});
  add("b", 3, {"SomeIpByteBufferMaxLength", "SomeIpByteBufferMinLength", "SomeIpByteBufferLengthWidth"});
  add("i", 3, {"SomeIpIntegerBitWidth", "SomeIpIntegerInvalidValue"});
  for (const char* rest : {"MinLength", "MaxLength", "LengthWidth"}) {
    table["SomeIpAttrMap" + std::string{rest}] = {"A", 3};
    table["SomeIpArgMap" + std::string{rest}] = {"a", 3};
  }
  const std::array<std::pair<const char*, const char*>, 4> prefixes{
      {{"SomeIpAttr", "A"}, {"SomeIpArg", "a"}, {"SomeIpStruct", "f"}, {"SomeIpUnion", "g"}}};
  for (const auto& [prefix, hosts] : prefixes) {
    for (const char* rest :
         {"ArrayMinLength", "ArrayMaxLength", "ArrayLengthWidth", "UnionLengthWidth", "UnionTypeWidth",
          "UnionDefaultOrder", "UnionMaxLength", "StructLengthWidth", "EnumWidth", "EnumBitWidth",
          "EnumInvalidValue", "IntegerBitWidth", "IntegerInvalidValue"}) {
      table[prefix + std::string{rest}] = {hosts, 1};
    }
  }
  return table;
}

const Table& table() {
  static const Table table = make_table();
  return table;
}

/// What an element of this tag can have. Elements that use a type also have what the type has, where that is
/// more than CommonAPI's tools allow.
std::string_view hosts_of(const Node& node, std::string_view parent) {
  static const std::map<std::string_view, std::string_view> hosts{
      {"interface", "I"}, {"typeCollection", ""}, {"provider", "P"},         {"instance", "N"},
      {"method", "M"},    {"broadcast", "B"},     {"attribute", "Arsuetbi"}, {"array", "rsuetbi"},
      {"struct", "s"},    {"union", "u"},         {"enumeration", "e"},      {"typedef", "rsuetbi"},
      {"map", ""},        {"key", "suetbi"},      {"value", "suetbi"},       {"#", "rsuetbi"},
      {"#struct", "s"},   {"#union", "u"},        {"#enumeration", "e"},     {"in", ""},
      {"out", ""}};
  if (node.tag.empty()) {
    return parent == "in" || parent == "out"           ? "arsuetbi"
           : parent == "struct" || parent == "#struct" ? "frsuetbi"
           : parent == "union" || parent == "#union"   ? "grsuetbi"
                                                       : "n";
  }
  const auto found = hosts.find(node.tag);
  return found == hosts.end() ? "" : found->second;
}

std::string shown(const Node& node) {
  return node.target.empty() ? fmt::format("'{}'", node.tag.empty() ? "an element" : node.tag)
                             : documents::quote(node.target.text);
}

void check(const Node& node, std::string_view parent, const std::vector<DeclaredKeys*>& declared,
           Problems& findings) {
  const std::string_view hosts = hosts_of(node, parent);
  for (const Setting& setting : node.settings) {
    const auto found = table().find(setting.key.text);
    if (found == table().end()) {
      const auto declares = [&](const DeclaredKeys* one) { return one->keys.contains(setting.key.text); };
      if (const auto own = std::ranges::find_if(declared, declares); own != declared.end()) {
        (*own)->unread.insert(setting.key.text);
      } else {
        findings.warning(setting.key.place, fmt::format("the key {} is not known, and is left out{}",
                                                        documents::quote(setting.key.text),
                                                        hint(setting.key.text, known_keys())));
      }
    } else if (found->second.hosts.find_first_of(hosts) == std::string_view::npos) {
      findings.warning(setting.key.place,
                       fmt::format("{} means nothing in {}, and is left out", setting.key.text, shown(node)));
    } else if (found->second.versions == 0) {
      findings.warning(
          setting.key.place,
          fmt::format("{} is in no version of CommonAPI's specification; it is taken for the reliable and "
                      "the unreliable port, where these are not given",
                      setting.key.text));
    } else if ((found->second.versions & node.version) == 0) {
      findings.warning(
          setting.key.place,
          fmt::format("{} belongs to version {} of CommonAPI's specification, and version {} is imported; "
                      "it is read all the same",
                      setting.key.text, found->second.versions, node.version));
    }
  }
  for (const Node& child : node.children) {
    check(child, node.tag, declared, findings);
  }
}

std::string shown(const SettingValue& value) {
  return value.kind == SettingValue::Kind::text ? '"' + documents::printable(value.text) + '"'
                                                : documents::quote(value.text);
}

const SettingValue* single(const Setting& setting, const char* expected, Problems& findings) {
  if (setting.list || setting.values.empty()) {
    findings.error(setting.key.place,
                   fmt::format("{} has a list of values; expected {}", setting.key.text, expected));
    return nullptr;
  }
  return &setting.values.front();
}

std::optional<std::int64_t> number_of(const Setting& setting, const SettingValue& value, std::int64_t min,
                                      std::int64_t max, Problems& findings) {
  if (value.kind != SettingValue::Kind::number || value.number < min || value.number > max) {
    findings.error(value.place, fmt::format("{} is {}; expected a whole number from {} to {}",
                                            setting.key.text, shown(value), min, max));
    return std::nullopt;
  }
  return value.number;
}

}  // namespace

const std::vector<std::string>& known_keys() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, key] : table()) {
      all.push_back(name);
    }
    return all;
  }();
  return names;
}

bool is_known_specification(std::string_view name) {
  return name == "org.genivi.commonapi.someip.deployment" || name == "org.genivi.commonapi.core.deployment" ||
         name == "org.genivi.commonapi.someip" || name == "org.genivi.commonapi.core";
}

void check_keys(const Node& deployment, const std::vector<DeclaredKeys*>& declared, Problems& findings) {
  check(deployment, "", declared, findings);
}

std::optional<std::int64_t> number_of(const Setting& setting, std::int64_t min, std::int64_t max,
                                      Problems& findings) {
  const SettingValue* value = single(setting, "a whole number", findings);
  return value == nullptr ? std::nullopt : number_of(setting, *value, min, max, findings);
}

std::vector<std::int64_t> numbers_of(const Setting& setting, std::int64_t min, std::int64_t max,
                                     Problems& findings) {
  std::vector<std::int64_t> numbers;
  for (const SettingValue& value : setting.values) {
    if (const auto number = number_of(setting, value, min, max, findings)) {
      numbers.push_back(*number);
    }
  }
  return numbers;
}

std::vector<std::string> texts_of(const Setting& setting, Problems& findings) {
  std::vector<std::string> texts;
  for (const SettingValue& value : setting.values) {
    if (value.kind != SettingValue::Kind::text) {
      findings.error(value.place,
                     fmt::format("{} is {}; expected a text in quotes", setting.key.text, shown(value)));
    }
    texts.push_back(value.text);
  }
  return texts;
}

std::optional<bool> truth_of(const Setting& setting, Problems& findings) {
  const SettingValue* value = single(setting, "true or false", findings);
  if (value == nullptr) {
    return std::nullopt;
  }
  if (value->kind != SettingValue::Kind::truth) {
    findings.error(value->place,
                   fmt::format("{} is {}; expected true or false", setting.key.text, shown(*value)));
    return std::nullopt;
  }
  return value->text == "true";
}

std::size_t word_of(const Setting& setting, const std::vector<std::string>& words, Problems& findings) {
  const SettingValue* value = single(setting, "one word", findings);
  if (value == nullptr) {
    return 0;
  }
  // "…deployment.Enums.utf8" is utf8.
  const std::string word = value->text.substr(value->text.rfind('.') + 1);
  const auto found = std::ranges::find(words, word);
  if (found == words.end()) {
    findings.error(value->place, fmt::format("{} is {}; expected one of {}{}", setting.key.text,
                                             shown(*value), fmt::join(words, ", "), hint(word, words)));
    return 0;
  }
  return static_cast<std::size_t>(found - words.begin());
}

std::string written(const Setting& setting) {
  std::string all;
  for (const SettingValue& value : setting.values) {
    all += all.empty() ? "" : ", ";
    if (value.kind == SettingValue::Kind::text) {
      all += '"';
      for (const char c : value.text) {
        all += c == '"' || c == '\\' ? "\\" : "";
        all += c;
      }
      all += '"';
    } else {
      all += (value.kind == SettingValue::Kind::reference ? "&" : "") + value.text;
    }
  }
  return setting.list ? "{ " + all + " }" : all;
}

}  // namespace trestle::describe::fidl
