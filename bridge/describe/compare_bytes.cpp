#include "bridge/describe/compare_bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace trestle::describe::comparing {

bool is_type(const Model& model, TypeIndex index) {
  return static_cast<std::size_t>(index) < model.types.size();
}

std::string rules_of(Kind kind, const Wire& wire) {
  std::string words = fmt::format("length field {} bits", 8 * bytes(wire.length));
  if (kind == Kind::choice) {
    words += fmt::format(", selector {} bits {}", 8 * bytes(wire.selector),
                         wire.length_first ? "behind the length" : "before the length");
  }
  if (kind == Kind::string) {
    constexpr std::array names{"UTF-8", "UTF-16LE", "UTF-16BE"};
    words += fmt::format(", {}{}{}", names.at(static_cast<std::size_t>(wire.encoding)),
                         wire.bom ? ", BOM" : "", wire.terminator ? ", terminator" : "");
  }
  if (wire.fixed_bytes != 0) {
    words += fmt::format(", always {} bytes", wire.fixed_bytes);
  }
  if (wire.bits != 0) {
    words += fmt::format(", {} bits", wire.bits);
  }
  if (wire.byte_order) {
    words += *wire.byte_order == std::endian::big ? ", big endian" : ", little endian";
  }
  return words;
}

std::string name_of(const Model& model, TypeIndex index) {
  std::string dimensions;
  for (std::size_t steps = 0; is_type(model, index); ++steps) {
    const Type& type = model.at(index);
    if (!type.name.empty()) {
      return type.name + dimensions;
    }
    const Type& behind = resolved(model, index);
    if (behind.kind != Kind::array || steps == max_type_nesting) {
      return (behind.kind == Kind::primitive ? messages::to_string(behind.primitive)
                                             : to_string(behind.kind)) +
             dimensions;
    }
    dimensions += "[]";
    index = behind.element.type;
  }
  return dimensions;
}

std::string_view word_of(std::endian order) {
  return order == std::endian::big ? "big endian" : "little endian";
}

messages::Primitive on_wire(messages::Primitive primitive) {
  return primitive == messages::Primitive::byte || primitive == messages::Primitive::character
             ? messages::Primitive::uint8
             : primitive;
}

bool is_number(const Type& type) {
  return type.kind == Kind::primitive || type.kind == Kind::enumeration;
}

bool is_bytes(const Model& model, const Type& type) {
  return type.kind == Kind::bytes ||
         (type.kind == Kind::array && resolved(model, type.element.type).kind == Kind::primitive &&
          on_wire(resolved(model, type.element.type).primitive) == messages::Primitive::uint8);
}

std::string Side::bytes_of(const std::string& element, const Value& use) {
  const Type& type = resolved(*model_, use.type);
  const std::string name = name_of(*model_, use.type);
  std::vector<std::string> words;
  const bool has_number = is_number(type);
  const std::string form = has_number ? messages::to_string(type.primitive) : to_string(type.kind);
  if (type.kind == Kind::enumeration) {
    words.emplace_back("enumeration");
  }
  if (form != name && type.kind != Kind::array) {
    words.push_back(form);
  }
  if (has_number) {
    const std::size_t width = messages::width(type.primitive);
    words.push_back(fmt::format("{} bits", use.wire.bits != 0 ? use.wire.bits : 8 * width));
    if (width > 1 && payload_ != nullptr) {
      words.emplace_back(word_of(use.wire.byte_order.value_or(order_)));
    }
  } else if (type.kind != Kind::alias &&
             !(type.kind == Kind::structure && use.wire.length == someip::FieldWidth::none)) {
    words.push_back(rules_of(type.kind, use.wire));
  }
  if (std::string offset = offset_of(element); !offset.empty()) {
    words.push_back(std::move(offset));
  }
  return words.empty() ? name : fmt::format("{} ({})", name, fmt::join(words, ", "));
}

std::string Side::offset_of(const std::string& element) {
  if (payload_ == nullptr || !element.starts_with(element_) || asked_ == max_offsets) {
    return {};
  }
  if (asked_++ == 0) {
    ranges_ = layout(*model_, *payload_).ranges;
  }
  std::string_view path = std::string_view{element}.substr(element_.size());
  path.remove_prefix(path.starts_with('.') ? 1 : 0);
  const auto found = std::ranges::find_if(ranges_, [&](const ByteRange& range) {
    const std::string_view there = range.path;
    return there.starts_with(path) &&
           (there.size() == path.size() || there[path.size()] == '.' || there[path.size()] == '[');
  });
  if (found == ranges_.end()) {
    return {};
  }
  return fmt::format("at byte {}{}", found->depth > 0 ? "+" : "", found->offset_text);
}

}  // namespace trestle::describe::comparing
