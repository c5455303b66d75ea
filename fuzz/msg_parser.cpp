// Property: what parse_msg() accepts, written out from the parsed definition, parses to an equal definition.
#include <fmt/format.h>

#include <cstdlib>
#include <span>

#include "bridge/messages/types/parsers.hpp"

using namespace trestle;

namespace {

std::string written(const messages::FieldType& type) {
  std::string text = type.primitive ? to_string(*type.primitive) : type.message;
  if (type.string_bound != 0) {
    text += fmt::format("<={}", type.string_bound);
  }
  switch (type.array) {
    case messages::ArrayKind::none:
      return text;
    case messages::ArrayKind::fixed:
      return fmt::format("{}[{}]", text, type.array_size);
    case messages::ArrayKind::bounded:
      return fmt::format("{}[<={}]", text, type.array_size);
    case messages::ArrayKind::unbounded:
      return text + "[]";
  }
  return text;
}

std::string written(const messages::MessageDefinition& message) {
  std::string text;
  for (const messages::Constant& constant : message.constants) {
    text += fmt::format("{} {} = {}\n", to_string(constant.type), constant.name, constant.value);
  }
  for (const messages::Field& field : message.fields) {
    text += fmt::format("{} {} {}\n", written(field.type), field.name, field.default_value);
  }
  return text;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string text(size, '\0');
  std::ranges::copy(std::span{data, size}, text.begin());
  const auto first = messages::parse_msg(text, "fuzz_msgs/msg/Fuzz", "Fuzz.msg");
  if (!first) {
    return 0;
  }
  const auto second = messages::parse_msg(written(*first), "fuzz_msgs/msg/Fuzz", "Fuzz.msg");
  if (!second || written(*second) != written(*first) || second->fields.size() != first->fields.size() ||
      second->constants.size() != first->constants.size()) {
    std::abort();
  }
  return 0;
}
