#include "test/bridge/messages/convert/cdr_walk.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

#include "someip/wire/payload_writer.hpp"
#include "test/fastcdr.hpp"

namespace trestle::test {
namespace {

using eprosima::fastcdr::Cdr;
using messages::ArrayKind;
using messages::FieldType;
using messages::MessageDefinition;
using messages::Primitive;

/// Writes what Walk reads with fastcdr.
class CdrOut {
 public:
  struct Open {};
  explicit CdrOut(Cdr& out) : out_{out} {}

  template <typename Value>
  void put(const Value& value) {
    out_ << value;
  }
  Open begin_struct() { return {}; }
  Open begin_array(bool fixed, std::uint32_t count) {
    if (!fixed) {
      out_ << count;
    }
    return {};
  }
  void end(const Open& /*element*/) {}
  /// As rosidl_typesupport_fastrtps does it: a count, and each unit as a uint32.
  void wide(const std::vector<std::uint32_t>& units) {
    out_ << static_cast<std::uint32_t>(units.size());
    for (const std::uint32_t unit : units) {
      out_ << unit;
    }
  }

 private:
  Cdr& out_;
};

/// Writes what Walk reads with PayloadWriter.
class PayloadOut {
 public:
  using Open = someip::PayloadWriter::Open;
  explicit PayloadOut(someip::PayloadWriter& out) : out_{out} {}

  void put(bool value) { out_.boolean(value); }
  void put(std::uint8_t value) { out_.u8(value); }
  void put(std::int8_t value) { out_.i8(value); }
  void put(std::uint16_t value) { out_.u16(value); }
  void put(std::int16_t value) { out_.i16(value); }
  void put(std::uint32_t value) { out_.u32(value); }
  void put(std::int32_t value) { out_.i32(value); }
  void put(std::uint64_t value) { out_.u64(value); }
  void put(std::int64_t value) { out_.i64(value); }
  void put(float value) { out_.f32(value); }
  void put(double value) { out_.f64(value); }
  void put(const std::string& value) { out_.string(value); }
  Open begin_struct() { return out_.begin_struct(); }
  Open begin_array(bool fixed, std::uint32_t /*count*/) {
    return fixed ? out_.begin_fixed_array() : out_.begin_array();
  }
  void end(const Open& element) { out_.end(element); }
  void wide(const std::vector<std::uint32_t>& /*units*/) { throw std::invalid_argument{"wstring"}; }

 private:
  someip::PayloadWriter& out_;
};

template <typename Out>
class Walk {
 public:
  Walk(const messages::TypeTree& tree, Cdr& in, Out out) : tree_{tree}, in_{in}, out_{out} {}

  void message(const MessageDefinition& definition) {
    const auto open = out_.begin_struct();
    if (definition.fields.empty()) {
      move<std::uint8_t>();
    }
    for (const auto& field : definition.fields) {
      array(field.type);
    }
    out_.end(open);
  }

 private:
  void array(const FieldType& type) {
    if (type.array == ArrayKind::none) {
      return single(type);
    }
    const bool fixed = type.array == ArrayKind::fixed;
    std::uint32_t count = type.array_size;
    if (!fixed) {
      in_ >> count;
    }
    const auto open = out_.begin_array(fixed, count);
    for (std::uint32_t i = 0; i < count; ++i) {
      single(type);
    }
    out_.end(open);
  }

  void single(const FieldType& type) {
    if (!type.primitive) {
      return message(tree_.messages[type.message_index]);
    }
    switch (*type.primitive) {
      case Primitive::boolean:
        return move<bool>();
      case Primitive::byte:
      case Primitive::character:
      case Primitive::uint8:
        return move<std::uint8_t>();
      case Primitive::int8:
        return move<std::int8_t>();
      case Primitive::int16:
        return move<std::int16_t>();
      case Primitive::uint16:
        return move<std::uint16_t>();
      case Primitive::int32:
        return move<std::int32_t>();
      case Primitive::uint32:
        return move<std::uint32_t>();
      case Primitive::int64:
        return move<std::int64_t>();
      case Primitive::uint64:
        return move<std::uint64_t>();
      case Primitive::float32:
        return move<float>();
      case Primitive::float64:
        return move<double>();
      case Primitive::string:
        return move<std::string>();
      case Primitive::wstring: {
        std::uint32_t count = 0;
        in_ >> count;
        std::vector<std::uint32_t> units(count);
        for (std::uint32_t& unit : units) {
          in_ >> unit;
        }
        out_.wide(units);
      }
    }
  }

  template <typename T>
  void move() {
    T value{};
    in_ >> value;
    out_.put(value);
  }

  const messages::TypeTree& tree_;
  Cdr& in_;
  Out out_;
};

}  // namespace

std::vector<std::byte> rewritten_by_fastcdr(const messages::TypeTree& tree, ByteView sample,
                                            std::endian order) {
  std::vector<char> bytes(sample.size());
  std::memcpy(bytes.data(), sample.data(), sample.size());
  eprosima::fastcdr::FastBuffer from{bytes.data(), bytes.size()};
  Cdr in{from, Cdr::DEFAULT_ENDIAN, dds_cdr};
  in.read_encapsulation();
  std::vector<char> room(2 * sample.size() + 64);  // zeros: fastcdr leaves padding as it finds it
  eprosima::fastcdr::FastBuffer to{room.data(), room.size()};
  Cdr out{to, order == std::endian::big ? Cdr::BIG_ENDIANNESS : Cdr::LITTLE_ENDIANNESS, dds_cdr};
  out.serialize_encapsulation();
  Walk<CdrOut>{tree, in, CdrOut{out}}.message(tree.root());
  std::vector<std::byte> result(written(out));
  std::memcpy(result.data(), room.data(), result.size());
  return result;
}

std::vector<std::byte> written_by_payload_writer(const messages::TypeTree& tree, ByteView sample,
                                                 const someip::PayloadRules& rules) {
  std::vector<char> bytes(sample.size());
  std::memcpy(bytes.data(), sample.data(), sample.size());
  eprosima::fastcdr::FastBuffer from{bytes.data(), bytes.size()};
  Cdr in{from, Cdr::DEFAULT_ENDIAN, dds_cdr};
  in.read_encapsulation();
  std::vector<std::byte> room(64 * sample.size() + 1024);
  someip::PayloadWriter out{room, rules};
  Walk<PayloadOut>{tree, in, PayloadOut{out}}.message(tree.root());
  const auto payload = out.finish();
  if (!payload) {
    throw std::runtime_error{to_string(payload.error())};
  }
  return {payload->begin(), payload->end()};
}

bool has_wstring(const messages::TypeTree& tree) {
  return std::ranges::any_of(tree.messages, [](const MessageDefinition& message) {
    return std::ranges::any_of(message.fields,
                               [](const auto& field) { return field.type.primitive == Primitive::wstring; });
  });
}

}  // namespace trestle::test
