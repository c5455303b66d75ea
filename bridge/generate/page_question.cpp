#include "bridge/generate/page_question.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"

namespace trestle::generate {
namespace {

using Parsed = nlohmann::json;

/// What ends the reading of a question.
class BadQuestion : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

const Parsed* find(const Parsed& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

/// @throws BadQuestion unless it is one.
const Parsed& an_object(const Parsed& value, const std::string& what) {
  if (!value.is_object()) {
    throw BadQuestion{what + ": expected an object"};
  }
  return value;
}

std::string text_of(const Parsed& object, const char* key) {
  const Parsed* const value = find(object, key);
  if (value == nullptr) {
    return {};
  }
  if (!value->is_string()) {
    throw BadQuestion{fmt::format("{}: expected a text", key)};
  }
  return value->get<std::string>();
}

std::uint16_t id_of(const Parsed& value, const std::string& what) {
  const auto format = documents::id_number(1, 0xfffe);
  const auto id = value.is_string() ? format.read(value.get<std::string>()) : std::nullopt;
  if (!id) {
    throw BadQuestion{fmt::format("{}: expected {} as a text", what, format.expected)};
  }
  return static_cast<std::uint16_t>(*id);
}

void read_id(const Parsed& object, const char* key, std::optional<std::uint16_t>& id,
             const std::string& what) {
  if (const Parsed* const value = find(object, key)) {
    id = id_of(*value, what + "." + key);
  }
}

/// A text of decimal digits.
template <typename Number>
void read_number(const Parsed& object, const char* key, std::uint64_t most, std::optional<Number>& number,
                 const std::string& what) {
  if (const Parsed* const value = find(object, key)) {
    const auto format = documents::whole_number(0, most);
    const auto read = value->is_string() ? format.read(value->get<std::string>()) : std::nullopt;
    if (!read) {
      throw BadQuestion{fmt::format("{}.{}: expected {} as a text", what, key, format.expected)};
    }
    number = static_cast<Number>(*read);
  }
}

/// A name that all targets can have.
void read_name(const Parsed& object, std::optional<std::string>& name, const std::string& what) {
  constexpr std::size_t longest = 128;  // AUTOSAR's
  if (find(object, "name") == nullptr) {
    return;
  }
  const std::string text = text_of(object, "name");
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const bool is_good =
      !text.empty() && text.size() <= longest && is_letter(text.front()) &&
      std::ranges::all_of(text, [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_'; });
  if (!is_good) {
    throw BadQuestion{
        fmt::format("{}.name: expected a letter and up to {} letters, digits and underscores behind it", what,
                    longest - 1)};
  }
  name = text;
}

void read_groups(const Parsed& object, std::optional<std::vector<someip::EventgroupId>>& groups,
                 const std::string& what) {
  const Parsed* const list = find(object, "eventgroups");
  if (list == nullptr) {
    return;
  }
  constexpr std::size_t most = 64;
  if (!list->is_array() || list->empty() || list->size() > most) {
    throw BadQuestion{fmt::format("{}.eventgroups: expected a list of 1 to {} ids", what, most)};
  }
  groups.emplace();
  for (const Parsed& one : *list) {
    const someip::EventgroupId id{id_of(one, what + ".eventgroups")};
    if (std::ranges::find(*groups, id) == groups->end()) {
      groups->push_back(id);
    }
  }
}

describe::MemberEdit member_edit_of(const Parsed& object, const std::string& what) {
  describe::MemberEdit edit;
  read_name(object, edit.name, what);
  read_id(object, "id", edit.id, what);
  read_id(object, "getter", edit.getter, what);
  read_id(object, "setter", edit.setter, what);
  read_id(object, "notifier", edit.notifier, what);
  read_groups(object, edit.eventgroups, what);
  if (const std::string transport = text_of(object, "transport"); transport == "tcp" || transport == "udp") {
    edit.transport = transport == "tcp" ? Transport::tcp : Transport::udp;
  } else if (!transport.empty()) {
    throw BadQuestion{what + ".transport: expected udp or tcp"};
  }
  return edit;
}

describe::ServiceEdit edit_of(const Parsed& object, const std::string& name) {
  describe::ServiceEdit edit;
  read_name(object, edit.name, name);
  read_id(object, "id", edit.id, name);
  read_id(object, "instance", edit.instance, name);
  read_number(object, "major", 0xfe, edit.major, name);  // 0xff is any version
  read_number(object, "minor", 0xffff'fffe, edit.minor, name);
  read_number(object, "udp_port", 0xffff, edit.udp_port, name);
  read_number(object, "tcp_port", 0xffff, edit.tcp_port, name);
  const auto members = [&](const char* key, describe::ServiceEdit::Members& into) {
    if (const Parsed* const all = find(object, key)) {
      for (const auto& [member, value] : an_object(*all, name + "." + key).items()) {
        const std::string what = name + "." + member;
        into[member] = member_edit_of(an_object(value, what), what);
      }
    }
  };
  members("methods", edit.methods);
  members("events", edit.events);
  members("fields", edit.fields);
  return edit;
}

/// @throws BadQuestion, nlohmann::json::exception
PageQuestion question_of(std::string_view text) {
  std::size_t values = 0;
  const Parsed json = Parsed::parse(text, [&](int depth, Parsed::parse_event_t, const Parsed&) {
    if (depth > max_question_depth || ++values > max_question_values) {
      throw BadQuestion{"the request has too many values, or is nested too deep"};
    }
    return true;
  });
  an_object(json, "the request");
  PageQuestion question;
  if (const Parsed* const files = find(json, "files")) {
    if (!files->is_array()) {
      throw BadQuestion{"files: expected a list"};
    }
    for (const Parsed& file : *files) {
      an_object(file, "files");
      question.files.push_back({text_of(file, "name"), text_of(file, "text")});
    }
  }
  if (const Parsed* const edits = find(json, "edits")) {
    for (const auto& [name, edit] : an_object(*edits, "edits").items()) {
      question.edits[name] = edit_of(an_object(edit, name), name);
    }
  }
  question.target = text_of(json, "target");
  question.service = text_of(json, "service");
  question.kind = text_of(json, "kind");
  question.member = text_of(json, "member");
  question.part = text_of(json, "part");
  question.access = text_of(json, "access");
  question.values = text_of(json, "values");
  return question;
}

}  // namespace

tl::expected<PageQuestion, std::string> read_question(std::string_view json) {
  try {
    return question_of(json);
  } catch (const std::exception& error) {
    return tl::unexpected{documents::printable(error.what())};
  }
}

}  // namespace trestle::generate
