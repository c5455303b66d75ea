#include "bridge/generate/page_question.hpp"

#include <fmt/format.h>

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

describe::ServiceEdit edit_of(const Parsed& object, const std::string& name) {
  describe::ServiceEdit edit;
  read_id(object, "id", edit.id, name);
  read_id(object, "instance", edit.instance, name);
  const auto each = [&](const char* key, const auto& add) {
    if (const Parsed* const members = find(object, key)) {
      for (const auto& [member, value] : an_object(*members, name + "." + key).items()) {
        add(member, value);
      }
    }
  };
  each("methods", [&](const std::string& member, const Parsed& value) {
    edit.methods[member] = id_of(value, name + "." + member);
  });
  each("events", [&](const std::string& member, const Parsed& value) {
    edit.events[member] = id_of(value, name + "." + member);
  });
  each("fields", [&](const std::string& member, const Parsed& value) {
    const std::string what = name + "." + member;
    describe::ServiceEdit::FieldIds& ids = edit.fields[member];
    an_object(value, what);
    read_id(value, "getter", ids.getter, what);
    read_id(value, "setter", ids.setter, what);
    read_id(value, "notifier", ids.notifier, what);
  });
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
