// Property: whatever PayloadReader accepts, by any rules and for any type, PayloadWriter writes again, and
// those bytes read as the same values and are used up. No type or payload makes the reader loop or read
// beyond the payload.
//
// The input is 4 bytes of rules, the type as in parse(), a byte 0xff, and the payload.
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "fuzz/payload_rules.hpp"
#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"

using namespace trestle;
using namespace trestle::someip;
using fuzz::Input;

namespace {

enum class Kind : std::uint8_t {
  boolean,
  u8,
  u16,
  u32,
  u64,
  f32,
  f64,
  bytes,
  string,
  fixed_string,
  array,
  fixed_array,
  structure,
  choice,
  tagged,  ///< a struct whose members have tags
};
constexpr std::size_t kinds = 15;

struct Type {
  Kind kind = Kind::u8;
  std::vector<Type> members;
};

struct Value {
  std::uint64_t number = 0;
  std::string text;
  std::vector<Value> members;
  friend bool operator==(const Value&, const Value&) = default;
};

constexpr std::size_t fixed_string_bytes = 12;
constexpr std::size_t fixed_array_size = 2;
constexpr std::size_t longest_member_bytes = 24;
constexpr std::size_t max_values =
    4096;  // arrays within arrays of tiny elements would take the fuzzer too long

/// One byte a kind; containers take members up to a byte of 0xfe or 0xff.
std::vector<Type> parse(Input& in, int depth) {
  std::vector<Type> result;
  while (result.size() < 6) {
    const unsigned byte = in.next();
    if (byte >= 0xfe) {
      break;
    }
    Type type{Kind{static_cast<std::uint8_t>(byte % kinds)}, {}};
    if (type.kind >= Kind::array) {
      if (depth == 3) {
        continue;
      }
      type.members = parse(in, depth + 1);
    }
    result.push_back(std::move(type));
  }
  return result;
}

class Codec {
 public:
  explicit Codec(const PayloadRules& rules) : rules_{rules} {}

  Value read(PayloadReader& in, const Type& type) {
    Value value;
    ++values_;
    switch (type.kind) {
      case Kind::boolean:
        value.number = in.boolean() ? 1 : 0;
        break;
      case Kind::u8:
        value.number = in.u8();
        break;
      case Kind::u16:
        value.number = in.u16();
        break;
      case Kind::u32:
        value.number = in.u32();
        break;
      case Kind::u64:
        value.number = in.u64();
        break;
      case Kind::f32:
        value.number = std::bit_cast<std::uint32_t>(in.f32());
        break;
      case Kind::f64:
        value.number = std::bit_cast<std::uint64_t>(in.f64());
        break;
      case Kind::bytes:
        for (const std::byte byte : in.byte_array()) {
          value.text += std::to_integer<char>(byte);
        }
        break;
      case Kind::string:
        value.text = in.string(room_);
        break;
      case Kind::fixed_string:
        value.text = in.fixed_string(fixed_string_bytes, room_);
        break;
      case Kind::array: {
        auto open = in.begin_array();
        while (values_ < max_values && in.more(open)) {
          read_members(in, type.members, value);
        }
        in.end(open);
        break;
      }
      case Kind::fixed_array: {
        const auto open = in.begin_fixed_array();
        for (std::size_t i = 0; i < fixed_array_size; ++i) {
          read_members(in, type.members, value);
        }
        in.end(open);
        break;
      }
      case Kind::structure: {
        const auto open = in.begin_struct();
        read_members(in, type.members, value);
        in.end(open);
        break;
      }
      case Kind::choice: {
        const auto open = in.begin_union(static_cast<std::uint32_t>(type.members.size()), longest());
        value.number = open.type;
        if (open.type != 0) {
          value.members.push_back(read(in, type.members[open.type - 1]));
        }
        in.end(open.open);
        break;
      }
      case Kind::tagged: {
        const auto open = in.begin_struct();
        if (has_tags()) {
          read_tagged(in, type, value);
        } else {
          read_members(in, type.members, value);
        }
        in.end(open);
        break;
      }
    }
    return value;
  }

  /// Known members are those whose data id counts the type's; `number` has a bit for each that was there.
  void read_tagged(PayloadReader& in, const Type& type, Value& value) {
    value.members.resize(type.members.size());
    while (const auto id = in.next_member()) {
      const auto index = static_cast<std::size_t>(*id);
      if (index < type.members.size() && (value.number >> index & 1U) == 0 && values_ < max_values) {
        value.number |= std::uint64_t{1} << index;
        value.members[index] = read(in, type.members[index]);
      }
    }
  }

  void read_members(PayloadReader& in, const std::vector<Type>& members, Value& value) {
    for (const Type& member : members) {
      value.members.push_back(read(in, member));
    }
  }

  void write(PayloadWriter& out, const Type& type, const Value& value) const {
    switch (type.kind) {
      case Kind::boolean:
        return out.boolean(value.number != 0);
      case Kind::u8:
        return out.u8(static_cast<std::uint8_t>(value.number));
      case Kind::u16:
        return out.u16(static_cast<std::uint16_t>(value.number));
      case Kind::u32:
        return out.u32(static_cast<std::uint32_t>(value.number));
      case Kind::u64:
        return out.u64(value.number);
      case Kind::f32:
        return out.f32(std::bit_cast<float>(static_cast<std::uint32_t>(value.number)));
      case Kind::f64:
        return out.f64(std::bit_cast<double>(value.number));
      case Kind::bytes:
        return out.byte_array(std::as_bytes(std::span{value.text}));
      case Kind::string:
        return out.string(value.text);
      case Kind::fixed_string:
        return out.fixed_string(value.text, fixed_string_bytes);
      case Kind::array:
        return write_members(out, out.begin_array(), type, value);
      case Kind::fixed_array:
        return write_members(out, out.begin_fixed_array(), type, value);
      case Kind::structure:
        return write_members(out, out.begin_struct(), type, value);
      case Kind::choice: {
        const auto open = out.begin_union(static_cast<std::uint32_t>(value.number), longest());
        if (value.number != 0) {
          write(out, type.members[value.number - 1], value.members[0]);
        }
        return out.end(open);
      }
      case Kind::tagged: {
        const auto open = out.begin_struct();
        if (!has_tags()) {
          return write_members(out, open, type, value);
        }
        for (std::size_t i = 0; i < type.members.size(); ++i) {
          if ((value.number >> i & 1U) != 0) {
            write(out.tagged(DataId{static_cast<std::uint16_t>(i)}), type.members[i], value.members[i]);
          }
        }
        return out.end(open);
      }
    }
  }

 private:
  void write_members(PayloadWriter& out, const PayloadWriter::Open& open, const Type& type,
                     const Value& value) const {
    for (std::size_t i = 0; i < value.members.size(); ++i) {
      write(out, type.members[i % type.members.size()], value.members[i]);
    }
    out.end(open);
  }
  [[nodiscard]] std::size_t longest() const {
    return rules_.union_length == FieldWidth::none ? longest_member_bytes : 0;
  }

  /// Zeros that fill up a union would read as tags.
  [[nodiscard]] bool has_tags() const { return rules_.union_length != FieldWidth::none; }

  PayloadRules rules_;
  std::array<char, 1U << 14U> room_{};
  std::size_t values_ = 0;
};

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input input{std::as_bytes(std::span{data, size})};
  const PayloadRules by = fuzz::payload_rules(input);
  const Type whole{Kind::structure, parse(input, 0)};
  PayloadReader in{input.rest(), by};
  const Value value = Codec{by}.read(in, whole);
  require(in.position() <= input.rest().size());
  if (in.error()) {
    return 0;
  }
  std::vector<std::byte> room(4 * size + 4096);
  PayloadWriter out{room, by};
  Codec{by}.write(out, whole, value);
  const auto payload = out.finish();
  if (!payload) {
    // Padding that was left out is put in, which can be too much for a short length field or a union's size.
    // A struct without a length field, of which only unknown members were there, has no bytes any more, and
    // cannot be an element of an array. A tag may announce a length field that the writer may not choose.
    require((payload.error() == WireError::bad_length &&
             (by.alignment > 1 || !by.smallest_tagged_length || by.struct_length == FieldWidth::none)) ||
            (payload.error() == WireError::bad_tag && by.tagged_length == FieldWidth::none));
    return 0;
  }
  PayloadReader again{*payload, by};
  require(Codec{by}.read(again, whole) == value);
  require(!again.error() && again.position() == payload->size());
  return 0;
}
