#include "bridge/describe/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "bridge/documents/problems.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::describe {
namespace {

using messages::Primitive;
using someip::FieldWidth;

/// Types in each other, of which nobody has so many; ends those that contain themselves.
constexpr int max_nesting = 48;
/// Longer arrays of numbers are one range.
constexpr std::size_t max_listed_numbers = 16;
/// Bytes and characters that a value shows.
constexpr std::size_t max_shown = 32;
constexpr std::size_t header_bytes = 16;
/// Of the sum that an offset is.
constexpr std::size_t max_terms_bytes = 1000;
constexpr std::string_view more_terms = " + …";

const char* order_text(std::endian order) {
  return order == std::endian::big ? "big endian" : "little endian";
}

std::string hex_of(ByteView bytes) {
  std::string text;
  for (const std::byte byte : bytes.first(std::min(bytes.size(), max_shown))) {
    text += fmt::format("{}{:02x}", text.empty() ? "" : " ", static_cast<unsigned>(byte));
  }
  return bytes.size() > max_shown ? text + " …" : text;
}

bool is_scalar_kind(Kind kind) {
  return kind == Kind::primitive || kind == Kind::enumeration;
}

std::string shown_type(const Model& model, const Type& type) {
  if (!type.name.empty()) {
    return type.name;
  }
  switch (type.kind) {
    case Kind::primitive:
      return messages::to_string(type.primitive);
    case Kind::array: {
      const auto at = static_cast<std::size_t>(type.element.type);
      const std::string element =
          at >= model.types.size() ? "?"
          : model.types[at].name.empty()
              ? (model.types[at].kind == Kind::primitive ? messages::to_string(model.types[at].primitive)
                                                         : to_string(model.types[at].kind))
              : model.types[at].name;
      return type.max_size == 0 ? element + "[]"
             : type.fixed_size  ? fmt::format("{}[{}]", element, type.max_size)
                                : fmt::format("{}[<={}]", element, type.max_size);
    }
    default:
      return to_string(type.kind);
  }
}

class LayoutWalker {
 public:
  LayoutWalker(const Model& model, const Payload& payload, std::optional<ByteView> bytes)
      : model_{model}, payload_{payload}, bytes_{bytes}, limit_{bytes ? bytes->size() : 0} {}

  Layout walk() {
    const std::string crc = crc_fault(payload_);
    if (bytes_ && !crc.empty()) {
      error("", crc);
    }
    members(payload_.values, "", payload_.byte_order, 0);
    end_bits();
    if (!bytes_ && !payload_.known) {
      variable("", "bytes", "what it carries is not known");
    }
    if (!bytes_ && !crc.empty() && !failed_) {
      push("(CRC)", "CRC", "no source says where it is and how it is made: it is neither sent nor read",
           std::to_string(payload_.crc_bytes));
      last().offset.reset();
      last().offset_text = "?";
    }
    if (bytes_ && at_ < bytes_->size()) {
      if (!failed_) {
        error("", fmt::format("{} bytes more than the description has", bytes_->size() - at_));
      }
      // One range, also where there is no room for more.
      push("", "bytes", "not described", std::to_string(bytes_->size() - at_), hex_of(bytes_->subspan(at_)));
      last().bytes = bytes_->size() - at_;
    }
    return std::move(layout_);
  }

 private:
  struct Place {
    std::size_t at = 0;
    std::string terms{};
    int depth = 0;
  };

  void error(std::string path, std::string text) {
    layout_.errors.push_back({at_, std::move(path), std::move(text)});
    failed_ = true;
  }

  /// The next `size` bytes as a range; nothing without bytes, or where there are too few.
  std::optional<ByteView> add(const std::string& path, std::string type, std::string rule, std::size_t size,
                              std::string value = {}) {
    end_bits();
    if (failed_) {
      return std::nullopt;
    }
    if (bytes_ && size > limit_ - at_) {
      error(path, fmt::format("{} byte{} needed, {} left", size, size == 1 ? " is" : "s are", limit_ - at_));
      return std::nullopt;
    }
    if (!has_room(path)) {
      return std::nullopt;
    }
    push(path, std::move(type), std::move(rule), std::to_string(size), std::move(value));
    layout_.ranges.back().bytes = size;
    const std::size_t begin = std::exchange(at_, at_ + size);
    return bytes_ ? std::optional{bytes_->subspan(begin, size)} : std::nullopt;
  }
  /// Whether one more range may be made; otherwise tells why not.
  bool has_room(const std::string& path) {
    if (layout_.ranges.size() >= max_ranges) {
      error(path, fmt::format("more than {} ranges", max_ranges));
      return false;
    }
    path_bytes_ += path.size();
    if (path_bytes_ > max_layout_path_bytes) {
      error({}, fmt::format("names of more than {} bytes", max_layout_path_bytes));
      return false;
    }
    return true;
  }
  void push(const std::string& path, std::string type, std::string rule, std::string size,
            std::string value = {}) {
    layout_.ranges.push_back({.offset = terms_.empty() ? std::optional{at_} : std::nullopt,
                              .offset_text = std::to_string(at_) + terms_,
                              .size_text = std::move(size),
                              .depth = depth_,
                              .path = path,
                              .type = std::move(type),
                              .rule = std::move(rule),
                              .value = std::move(value)});
  }
  ByteRange& last() { return layout_.ranges.back(); }

  /// Something of variable size, without bytes.
  void variable(const std::string& path, std::string type, std::string rule) {
    end_bits();
    if (failed_ || !has_room(path)) {
      return;
    }
    push(path, std::move(type), std::move(rule), "variable");
  }
  /// From here on offsets depend on the size of `path`.
  void after_variable(const std::string& path) {
    if (terms_.ends_with(more_terms)) {
      return;
    }
    // Each range behind it repeats all of them.
    terms_ += terms_.size() + path.size() > max_terms_bytes ? std::string{more_terms} : " + " + path;
  }
  /// Of structures and choices: copies, so they are made once.
  const std::vector<Value>& members_of(const Type& type) {
    const auto [known, is_new] = members_.try_emplace(&type);
    if (is_new) {
      known->second = all_members(model_, type);
    }
    return known->second;
  }

  [[nodiscard]] Place enter() { return {std::exchange(at_, 0), std::exchange(terms_, {}), depth_++}; }
  void leave(Place place) {
    at_ = place.at;
    terms_ = std::move(place.terms);
    depth_ = place.depth;
  }

  [[nodiscard]] static std::uint64_t number(ByteView bytes, std::endian order) {
    std::uint64_t value = 0;
    for (std::size_t at = 0; at < bytes.size(); ++at) {
      const std::byte byte = order == std::endian::big ? bytes[at] : bytes[bytes.size() - 1 - at];
      value = (value << 8U) | static_cast<std::uint64_t>(byte);
    }
    return value;
  }
  [[nodiscard]] std::endian length_order() const {
    return payload_.length_fields_always_big ? std::endian::big : payload_.byte_order;
  }
  /// A length or selector field.
  std::optional<std::uint64_t> count(const std::string& path, const char* type, FieldWidth width,
                                     const char* what) {
    if (std::exchange(tag_has_width_, false)) {
      end_bits();
      if (!failed_ && has_room(path)) {
        push(path, type, fmt::format("{}, {}; the tag tells how wide", order_text(length_order()), what),
             "1, 2 or 4");
        after_variable("length of " + path);
      }
      return std::nullopt;
    }
    const auto bytes =
        add(path, type, fmt::format("{}, {}", order_text(length_order()), what), someip::bytes(width));
    if (!bytes) {
      return std::nullopt;
    }
    const std::uint64_t value = number(*bytes, length_order());
    last().value = std::to_string(value);
    return value;
  }

  void members(const std::vector<Value>& values, const std::string& path, std::endian order, int nesting);
  void untagged(const Value& value, const std::string& path, std::endian order, int nesting);
  void tagged(const std::vector<Value>& values, const std::string& path, std::endian order, int nesting);
  void use(TypeIndex index, Wire wire, const std::string& path, std::endian order, int nesting,
           bool is_tagged = false);
  void scalar(const Type& type, const Wire& wire, const std::string& path, std::endian order);
  void scalar_bits(const Type& type, unsigned bits, const std::string& path, std::endian order);
  void end_bits();
  void string(const Type& type, const Wire& wire, const std::string& path);
  void array(const Type& type, const Wire& wire, const std::string& path, std::endian order, int nesting);
  void structure(const Type& type, const Wire& wire, const std::string& path, std::endian order, int nesting);
  void choice(const Type& type, const Wire& wire, const std::string& path, std::endian order, int nesting,
              bool is_tagged);
  void element(const Type& type, const std::string& path, std::endian order, int nesting);
  void pad(const std::string& path);
  [[nodiscard]] std::string value_of(const Type& type, std::uint64_t raw, unsigned bits) const;

  /// Runs `inside` with the next `length` bytes as all that there is, and takes what is left of them.
  template <typename Inside>
  void within(std::uint64_t length, const std::string& path, const Inside& inside) {
    if (failed_) {
      return;
    }
    if (bytes_ && length > limit_ - at_) {
      error(path, fmt::format("the length is {}, {} bytes are left", length, limit_ - at_));
      return;
    }
    const std::size_t outer = bytes_ ? std::exchange(limit_, at_ + static_cast<std::size_t>(length)) : limit_;
    inside();
    end_bits();
    if (bytes_ && !failed_ && at_ < limit_) {
      add(path, "bytes", "not known here, skipped by the length", limit_ - at_,
          hex_of(bytes_->subspan(at_, limit_ - at_)));
    }
    limit_ = outer;
  }

  const Model& model_;
  const Payload& payload_;
  std::optional<ByteView> bytes_;
  std::size_t limit_;
  std::size_t at_ = 0;
  std::string terms_;
  int depth_ = 0;
  unsigned bit_ = 0;  ///< bits of the byte at `at_` that are taken
  bool failed_ = false;
  bool tag_has_width_ = false;  ///< without bytes: the next length field is as wide as a tag says
  std::size_t uses_ = 0;
  std::size_t path_bytes_ = 0;
  /// Names by value, of the enumerations that were met: the first of each value.
  mutable std::map<const Type*, std::map<std::uint64_t, std::string>> enumerators_;
  std::map<const Type*, std::vector<Value>> members_;
  Layout layout_;
};

void LayoutWalker::members(const std::vector<Value>& values, const std::string& path, std::endian order,
                           int nesting) {
  if (std::ranges::any_of(values, [](const Value& one) { return one.tag.has_value(); })) {
    tagged(values, path, order, nesting);
    return;
  }
  for (const Value& value : values) {
    if (failed_) {
      return;
    }
    untagged(value, path.empty() ? value.name : path + "." + value.name, order, nesting);
  }
}

void LayoutWalker::untagged(const Value& value, const std::string& path, std::endian order, int nesting) {
  use(value.type, value.wire, path, value.wire.byte_order.value_or(order), nesting + 1);
}

void LayoutWalker::tagged(const std::vector<Value>& values, const std::string& path, std::endian order,
                          int nesting) {
  const auto path_of = [&](const Value& one) { return path.empty() ? one.name : path + "." + one.name; };
  const auto tag_text = [](const Value& one) {
    return fmt::format("data id {}", static_cast<unsigned>(*one.tag));
  };
  if (!bytes_) {
    for (const Value& one : values) {
      if (one.tag && !failed_) {
        add(path_of(one), "tag", tag_text(one) + ", big endian" + (one.optional ? ", may be missing" : ""),
            someip::tag_bytes);
        Wire wire = one.wire;
        // Of wire types 5, 6 and 7: some width, which the tag tells.
        tag_has_width_ = payload_.smallest_tagged_length;
        wire.length = tag_has_width_ ? FieldWidth::bits32 : payload_.tagged_length;
        use(one.type, wire, path_of(one), wire.byte_order.value_or(order), nesting + 1, true);
        tag_has_width_ = false;  // a number has no length field
        if (one.optional) {
          after_variable(path_of(one) + "?");
        }
      }
    }
    return;
  }
  while (!failed_ && at_ < limit_) {
    const auto bytes = add(path, "tag", "big endian", someip::tag_bytes);
    if (!bytes) {
      return;
    }
    const someip::Tag tag = someip::to_tag(static_cast<std::uint16_t>(number(*bytes, std::endian::big)));
    last().value = fmt::format("data id {}, wire type {}", static_cast<unsigned>(tag.id),
                               static_cast<unsigned>(tag.type));
    const auto found = std::ranges::find_if(values, [&](const Value& one) { return one.tag == tag.id; });
    uses_ += static_cast<std::size_t>(found - values.begin());
    someip::PayloadRules by_tag;
    by_tag.tagged_length = payload_.tagged_length;
    if (found == values.end()) {
      if (const auto size = someip::number_bytes(tag.type)) {
        if (const auto skipped = add(path, "bytes", "a member that is not known", *size)) {
          last().value = hex_of(*skipped);
        }
      } else if (const auto length =
                     count(path, "length", someip::length_width(tag.type, by_tag), "bytes that follow")) {
        within(*length, path, [] {});
      }
      continue;
    }
    last().path = path_of(*found);
    Wire wire = found->wire;
    wire.length = someip::length_width(tag.type, by_tag);
    use(found->type, wire, path_of(*found), wire.byte_order.value_or(order), nesting + 1, true);
  }
}

void LayoutWalker::use(TypeIndex index, Wire wire, const std::string& path, std::endian order, int nesting,
                       bool is_tagged) {
  if (failed_) {
    return;
  }
  if (++uses_ > max_layout_uses) {
    error(path, fmt::format("more than {} uses of types", max_layout_uses));
    return;
  }
  if (static_cast<std::size_t>(index) >= model_.types.size() || nesting > max_nesting) {
    if (bytes_) {
      error(path, "a type that is not known, or too deep in others");
    } else {
      variable(path, "…", "and so on");
    }
    return;
  }
  const Type& type = model_.at(index);
  switch (type.kind) {
    case Kind::primitive:
    case Kind::enumeration:
      scalar(type, wire, path, order);
      break;
    case Kind::string:
      string(type, wire, path);
      break;
    case Kind::bytes:
    case Kind::array:
    case Kind::map:
      array(type, wire, path, order, nesting);
      break;
    case Kind::structure:
      structure(type, wire, path, order, nesting);
      break;
    case Kind::choice:
      choice(type, wire, path, order, nesting, is_tagged);
      break;
    case Kind::alias:
      use(type.element.type, wire, path, order, nesting + 1, is_tagged);
      break;
  }
}

std::string LayoutWalker::value_of(const Type& type, std::uint64_t raw, unsigned bits) const {
  const Primitive primitive = type.primitive;
  if (type.kind == Kind::primitive) {
    if (primitive == Primitive::boolean) {
      return (raw & 1U) != 0 ? "true" : "false";
    }
    if (primitive == Primitive::float32) {
      return fmt::format("{}", std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
    }
    if (primitive == Primitive::float64) {
      return fmt::format("{}", std::bit_cast<double>(raw));
    }
  }
  const bool is_signed = primitive == Primitive::int8 || primitive == Primitive::int16 ||
                         primitive == Primitive::int32 || primitive == Primitive::int64;
  const bool is_negative = is_signed && bits < 64 && bits > 0 && ((raw >> (bits - 1)) & 1U) != 0;
  const std::uint64_t extended = is_negative ? raw | (~std::uint64_t{0} << bits) : raw;
  const std::string text =
      is_signed ? fmt::format("{}", static_cast<std::int64_t>(extended)) : fmt::format("{}", raw);
  if (type.kind == Kind::enumeration) {
    const auto [names, is_new] = enumerators_.try_emplace(&type);
    if (is_new) {
      for (const Enumerator& one : all_enumerators(model_, type)) {
        names->second.try_emplace(static_cast<std::uint64_t>(one.value), one.name);
      }
    }
    const auto found = names->second.find(extended);
    return found == names->second.end() ? text + " (no enumerator)"
                                        : fmt::format("{} ({})", found->second, text);
  }
  return text;
}

void LayoutWalker::scalar(const Type& type, const Wire& wire, const std::string& path, std::endian order) {
  const std::size_t width = messages::width(type.primitive);
  if (wire.bits != 0 || bit_ != 0) {
    scalar_bits(type, wire.bits != 0 ? wire.bits : static_cast<unsigned>(width) * 8, path, order);
    return;
  }
  const auto bytes = add(path, shown_type(model_, type), width > 1 ? order_text(order) : "", width);
  if (bytes) {
    last().value = value_of(type, number(*bytes, order), static_cast<unsigned>(width) * 8);
  }
}

/// Bits fill bytes from the lowest one on; a number of more than 8 bits is cut into bytes before, in its byte
/// order: docs/conversion.md.
void LayoutWalker::scalar_bits(const Type& type, unsigned bits, const std::string& path, std::endian order) {
  if (failed_ || bits > 64) {
    return;
  }
  const std::size_t end = at_ + (bit_ + bits + 7) / 8;
  if (bytes_ && end > limit_) {
    error(path, fmt::format("{} bits are needed, {} are left", bits, (limit_ - at_) * 8 - bit_));
    return;
  }
  if (!has_room(path)) {
    return;
  }
  push(path, shown_type(model_, type),
       fmt::format("from bit {} on{}", bit_, bits > 8 ? std::string{", "} + order_text(order) : ""),
       fmt::format("{} bits", bits));
  last().bytes = end - at_;
  std::uint64_t value = 0;
  unsigned taken = 0;
  const unsigned first = order == std::endian::big && bits % 8 != 0 ? bits % 8 : std::min(bits, 8U);
  for (unsigned part = first; taken < bits; part = std::min(bits - taken, 8U)) {
    std::uint64_t chunk = 0;
    for (unsigned at = 0; at < part; ++at) {
      if (bytes_) {
        chunk |= static_cast<std::uint64_t>((static_cast<unsigned>((*bytes_)[at_]) >> bit_) & 1U) << at;
      }
      if (++bit_ == 8) {
        bit_ = 0;
        ++at_;
      }
    }
    value = order == std::endian::big ? (value << part) | chunk : value | (chunk << taken);
    taken += part;
  }
  if (bytes_) {
    last().value = value_of(type, value, bits);
  }
}

void LayoutWalker::end_bits() {
  if (bit_ != 0) {
    bit_ = 0;
    ++at_;
  }
}

std::string text_value(ByteView bytes, const Wire& wire) {
  std::string text;
  const bool is_utf8 = wire.encoding == someip::StringEncoding::utf8;
  const std::endian order =
      wire.encoding == someip::StringEncoding::utf16le ? std::endian::little : std::endian::big;
  while (!bytes.empty() && text.size() < 4 * max_shown) {
    const auto character = is_utf8 ? someip::first_utf8(bytes) : someip::first_utf16(bytes, order);
    if (!character) {
      return "no text: " + hex_of(bytes);
    }
    if (character->code == 0) {
      break;
    }
    if (character->code == U'"' || character->code == U'\\') {
      text += '\\';
    }
    const bool is_first_mark = character->code == someip::byte_order_mark && text.empty();
    if (!is_first_mark && documents::is_control(character->code)) {
      text += fmt::format("\\{}{:0{}x}", character->code < 0x80 ? 'x' : 'u',
                          static_cast<unsigned>(character->code), character->code < 0x80 ? 2 : 4);
    } else if (!is_first_mark) {
      std::byte encoded[4];
      someip::put_utf8(character->code, encoded);
      for (std::size_t at = 0; at < someip::utf8_bytes(character->code); ++at) {
        text += static_cast<char>(encoded[at]);
      }
    }
    bytes = bytes.subspan(character->bytes);
  }
  return "\"" + text + "\"";
}

void LayoutWalker::string(const Type& type, const Wire& wire, const std::string& path) {
  const char* encoding = wire.encoding == someip::StringEncoding::utf8      ? "UTF-8"
                         : wire.encoding == someip::StringEncoding::utf16le ? "UTF-16 little endian"
                                                                            : "UTF-16 big endian";
  std::string rule =
      fmt::format("{}{}{}", encoding, wire.bom ? ", BOM" : "", wire.terminator ? ", terminator" : "");
  if (wire.length == FieldWidth::none && wire.fixed_bytes != 0) {
    if (const auto bytes =
            add(path, shown_type(model_, type), rule + ", filled up with zeros", wire.fixed_bytes)) {
      last().value = text_value(*bytes, wire);
    }
    return;
  }
  if (wire.length == FieldWidth::none) {
    if (!bytes_) {
      variable(path, shown_type(model_, type), rule + ", to the terminator");
      after_variable(path);
      return;
    }
    const std::size_t unit = wire.encoding == someip::StringEncoding::utf8 ? 1 : 2;
    std::size_t size = 0;
    while (at_ + size + unit <= limit_ && number(bytes_->subspan(at_ + size, unit), std::endian::big) != 0) {
      size += unit;
    }
    size = std::min(size + unit, limit_ - at_);
    if (const auto bytes = add(path, shown_type(model_, type), rule + ", to the terminator", size)) {
      last().value = text_value(*bytes, wire);
    }
    return;
  }
  const auto length = count(path, "length", wire.length, "bytes of the text");
  if (!bytes_) {
    variable(path, shown_type(model_, type), rule);
    after_variable(path);
  } else if (length) {
    within(*length, path, [&] {
      if (const auto bytes = add(path, shown_type(model_, type), rule, limit_ - at_)) {
        last().value = text_value(*bytes, wire);
      }
    });
  }
  pad(path);
}

void LayoutWalker::pad(const std::string& path) {
  if (payload_.alignment <= 1 || failed_) {
    return;
  }
  if (!bytes_) {
    variable(path, "padding", fmt::format("zeros up to a multiple of {} bytes", payload_.alignment));
    return;
  }
  const std::size_t over = (header_bytes + at_) % payload_.alignment;
  const std::size_t size = std::min(over == 0 ? 0 : payload_.alignment - over, limit_ - at_);
  if (size != 0) {
    add(path, "padding", fmt::format("zeros up to a multiple of {} bytes", payload_.alignment), size);
  }
}

void LayoutWalker::element(const Type& type, const std::string& path, std::endian order, int nesting) {
  if (type.kind == Kind::bytes) {
    add(path, "uint8", "", 1);
  } else if (type.kind == Kind::map) {
    untagged(type.key, path + ".key", order, nesting);
    untagged(type.element, path + ".value", order, nesting);
  } else {
    untagged(type.element, path, order, nesting);
  }
}

void LayoutWalker::array(const Type& type, const Wire& wire, const std::string& path, std::endian order,
                         int nesting) {
  std::optional<std::uint64_t> length;
  if (wire.length != FieldWidth::none) {
    length = count(path, "length", wire.length, "bytes of all elements");
  }
  const std::string name = shown_type(model_, type);
  if (!bytes_) {
    const std::size_t before = layout_.ranges.size();
    variable(path, name,
             type.fixed_size      ? fmt::format("{} elements", type.max_size)
             : type.max_size != 0 ? fmt::format("{} to {} elements", type.min_size, type.max_size)
                                  : "any number of elements");
    if (failed_ || type.kind == Kind::bytes) {
      after_variable(path);
      return;
    }
    Place outside = enter();
    element(type, path + "[]", order, nesting);
    end_bits();
    const std::optional<std::size_t> size = terms_.empty() ? std::optional{at_} : std::nullopt;
    leave(std::move(outside));
    if (failed_ || !size || !type.fixed_size) {
      if (size && !failed_) {
        layout_.ranges[before].size_text = fmt::format("n × {}", *size);
      }
      after_variable(path);
    } else {
      layout_.ranges[before].bytes = *size * type.max_size;
      layout_.ranges[before].size_text = std::to_string(*size * type.max_size);
      at_ += *size * type.max_size;
    }
    if (length || !type.fixed_size) {
      pad(path);
    }
    return;
  }
  const auto number_width = [&]() -> std::size_t {
    if (type.kind == Kind::bytes) {
      return 1;
    }
    const auto at = static_cast<std::size_t>(type.element.type);
    const bool is_plain = type.kind == Kind::array && at < model_.types.size() &&
                          type.element.wire.bits == 0 &&
                          is_scalar_kind(resolved(model_, type.element.type).kind);
    return is_plain ? messages::width(resolved(model_, type.element.type).primitive) : 0;
  }();
  const auto elements = [&](bool to_the_end) {
    const std::size_t fixed = type.max_size;
    const std::size_t left = limit_ - at_;
    const std::size_t plain = to_the_end ? left : std::min(left, fixed * number_width);
    if (number_width != 0 && (type.kind == Kind::bytes || plain > max_listed_numbers * number_width)) {
      const std::size_t wanted = to_the_end ? left / number_width * number_width : fixed * number_width;
      if (const auto bytes = add(path, name, fmt::format("{} elements", wanted / number_width), wanted)) {
        last().value = hex_of(*bytes);
      }
      return;
    }
    for (std::size_t at = 0; !failed_ && (to_the_end ? at_ < limit_ : at < fixed); ++at) {
      const std::size_t begin = at_;
      element(type, fmt::format("{}[{}]", path, at), order, nesting);
      end_bits();
      if (!failed_ && to_the_end && at_ == begin) {
        error(path, "elements without bytes");
      }
      if (type.fixed_size && at + 1 >= fixed) {
        break;  // further ones are skipped by the length
      }
    }
  };
  if (length) {
    within(*length, path, [&] { elements(true); });
    pad(path);
  } else if (wire.length == FieldWidth::none) {
    elements(!type.fixed_size);
  }
}

void LayoutWalker::structure(const Type& type, const Wire& wire, const std::string& path, std::endian order,
                             int nesting) {
  if (is_polymorphic(model_, type)) {
    error(path, "a polymorphic structure");
    return;
  }
  const auto inside = [&] { members(members_of(type), path, order, nesting); };
  if (wire.length == FieldWidth::none) {
    inside();
    return;
  }
  const auto length = count(path, "length", wire.length, "bytes of all members");
  if (!bytes_) {
    inside();
  } else if (length) {
    within(*length, path, inside);
  }
}

void LayoutWalker::choice(const Type& type, const Wire& wire, const std::string& path, std::endian order,
                          int nesting, bool is_tagged) {
  std::optional<std::uint64_t> length;
  std::optional<std::uint64_t> selector;
  const bool has_length = wire.length != FieldWidth::none;
  const auto length_field = [&] {
    if (has_length) {
      length =
          count(path, "length", wire.length, is_tagged ? "bytes of selector and data" : "bytes of the data");
    }
  };
  const auto selector_field = [&] {
    if (wire.selector != FieldWidth::none) {
      selector = count(path, "selector", wire.selector, "which member follows");
    }
  };
  const bool length_first = wire.length_first || is_tagged;
  if (length_first) {
    length_field();
  }
  selector_field();
  if (!length_first) {
    length_field();
  }
  const std::vector<Value>& members = members_of(type);
  const auto selector_of = [&](std::size_t at) {
    return at < type.selectors.size() ? type.selectors[at] : static_cast<std::uint32_t>(at + 1);
  };
  if (!bytes_) {
    for (std::size_t at = 0; at < members.size() && !failed_; ++at) {
      const std::string member = path + "." + members[at].name;
      const std::size_t before = layout_.ranges.size();
      variable(member, "member", fmt::format("if the selector is {}", selector_of(at)));
      Place outside = enter();
      untagged(members[at], member, order, nesting);
      end_bits();
      if (terms_.empty() && before < layout_.ranges.size()) {
        layout_.ranges[before].size_text = std::to_string(at_);
      }
      leave(std::move(outside));
    }
    if (!has_length && wire.fixed_bytes != 0) {
      at_ += wire.fixed_bytes;
    } else {
      after_variable(path);
    }
    pad(path);
    return;
  }
  if (failed_ || !selector) {
    return;
  }
  const auto data = [&] {
    for (std::size_t at = 0; at < members.size(); ++at) {
      if (selector_of(at) == *selector) {
        untagged(members[at], path + "." + members[at].name, order, nesting);
        return;
      }
    }
    if (*selector != 0) {
      error(path, fmt::format("no member has the selector {}", *selector));
    }
  };
  if (has_length) {
    const std::size_t counted = is_tagged ? someip::bytes(wire.selector) : 0;
    within(length.value_or(0) >= counted ? length.value_or(0) - counted : 0, path, data);
    pad(path);
  } else if (wire.fixed_bytes != 0) {
    within(wire.fixed_bytes, path, data);
  } else {
    data();
  }
}

/// Whether `is_meant` is true of a value in the payload, and the type behind its aliases.
bool any_value(const Model& model, const Payload& payload, const auto& is_meant) {
  std::vector<const Value*> open;
  for (const Value& value : payload.values) {
    open.push_back(&value);
  }
  std::set<const Type*> seen;
  while (!open.empty()) {
    const Value& value = *open.back();
    open.pop_back();
    const Type& type = resolved(model, value.type);
    if (is_meant(value, type)) {
      return true;
    }
    const Type* part = &type;
    for (std::size_t bases = 0; seen.insert(part).second && bases <= max_type_nesting; ++bases) {
      for (const Value& member : part->members) {
        open.push_back(&member);
      }
      if (part->kind == Kind::array || part->kind == Kind::map) {
        open.push_back(&part->element);
      }
      if (part->kind == Kind::map) {
        open.push_back(&part->key);
      }
      if (part->base == no_type) {
        break;
      }
      part = &resolved(model, part->base);
    }
  }
  return false;
}

}  // namespace

Payload response_of(const Model& model, const Method& method) {
  Payload response = method.response;
  if (static_cast<std::size_t>(method.error) < model.types.size()) {
    response.values.insert(
        response.values.begin(),
        {.name = "error", .type = method.error, .wire = resolved(model, method.error).wire});
  }
  return response;
}

bool has_length_fields(const Model& model, const Payload& payload) {
  const auto has_order = [](someip::FieldWidth width) { return someip::bytes(width) > 1; };
  return any_value(model, payload, [&](const Value& value, const Type& type) {
    const bool is_tagged = value.tag && (has_order(payload.tagged_length) || payload.smallest_tagged_length);
    return is_tagged || (type.kind != Kind::primitive && has_order(value.wire.length)) ||
           (type.kind == Kind::choice && has_order(value.wire.selector));
  });
}

bool is_polymorphic(const Model& model, const Type& type) {
  const Type* part = &type;
  for (std::size_t bases = 0; !part->polymorphic && part->base != no_type; ++bases) {
    if (bases == max_type_nesting) {
      return false;
    }
    part = &resolved(model, part->base);
  }
  return part->polymorphic;
}

bool has_tagged_lengths(const Model& model, const Payload& payload) {
  return any_value(model, payload, [](const Value& value, const Type& type) {
    return value.tag && type.kind != Kind::primitive && type.kind != Kind::enumeration;
  });
}

std::set<FieldWidth> tagged_widths(const Model& model, const Payload& payload) {
  std::set<FieldWidth> widths;
  any_value(model, payload, [&](const Value& value, const Type& type) {
    if (value.tag && !is_scalar_kind(type.kind) && value.wire.length != FieldWidth::none) {
      widths.insert(value.wire.length);
    }
    return false;
  });
  return widths;
}

std::string crc_fault(const Payload& payload) {
  return payload.crc_bytes == 0
             ? std::string{}
             : fmt::format("a CRC of {} byte{} in the payload, which Trestle does not make",
                           payload.crc_bytes, payload.crc_bytes == 1 ? "" : "s");
}

Layout layout(const Model& model, const Payload& payload) {
  return LayoutWalker{model, payload, std::nullopt}.walk();
}

Layout layout(const Model& model, const Payload& payload, ByteView bytes) {
  return LayoutWalker{model, payload, bytes}.walk();
}

}  // namespace trestle::describe
