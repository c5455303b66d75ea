#include "test/bridge/convert/cdr_walk.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <cstring>
#include <string>

namespace trestle::test {
namespace {

using bridge::ArrayKind;
using bridge::FieldType;
using bridge::MessageDefinition;
using bridge::Primitive;
using eprosima::fastcdr::Cdr;

class Walk {
 public:
  Walk(const bridge::TypeTree& tree, Cdr& in, Cdr& out) : tree_{tree}, in_{in}, out_{out} {}

  void message(const MessageDefinition& definition) {
    if (definition.fields.empty()) {
      number<std::uint8_t>();
    }
    for (const auto& field : definition.fields) {
      array(field.type);
    }
  }

 private:
  void array(const FieldType& type) {
    std::uint32_t count = 1;
    if (type.array == ArrayKind::fixed) {
      count = type.array_size;
    } else if (type.array != ArrayKind::none) {
      in_ >> count;
      out_ << count;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      single(type);
    }
  }

  void single(const FieldType& type) {
    if (!type.primitive) {
      return message(tree_.messages[type.message_index]);
    }
    switch (*type.primitive) {
      case Primitive::boolean:
        return number<bool>();
      case Primitive::byte:
      case Primitive::character:
      case Primitive::uint8:
        return number<std::uint8_t>();
      case Primitive::int8:
        return number<std::int8_t>();
      case Primitive::int16:
        return number<std::int16_t>();
      case Primitive::uint16:
        return number<std::uint16_t>();
      case Primitive::int32:
        return number<std::int32_t>();
      case Primitive::uint32:
        return number<std::uint32_t>();
      case Primitive::int64:
        return number<std::int64_t>();
      case Primitive::uint64:
        return number<std::uint64_t>();
      case Primitive::float32:
        return number<float>();
      case Primitive::float64:
        return number<double>();
      case Primitive::string:
        return number<std::string>();
      case Primitive::wstring: {
        // As rosidl_typesupport_fastrtps does it: a count, and each unit as a uint32.
        std::uint32_t units = 0;
        in_ >> units;
        out_ << units;
        for (std::uint32_t i = 0; i < units; ++i) {
          number<std::uint32_t>();
        }
      }
    }
  }

  template <typename T>
  void number() {
    T value{};
    in_ >> value;
    out_ << value;
  }

  const bridge::TypeTree& tree_;
  Cdr& in_;
  Cdr& out_;
};

}  // namespace

std::vector<std::byte> rewritten_by_fastcdr(const bridge::TypeTree& tree, ByteView sample,
                                            std::endian order) {
  std::vector<char> bytes(sample.size());
  std::memcpy(bytes.data(), sample.data(), sample.size());
  eprosima::fastcdr::FastBuffer from{bytes.data(), bytes.size()};
  Cdr in{from, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR};
  in.read_encapsulation();
  std::vector<char> room(2 * sample.size() + 64);  // zeros: fastcdr leaves padding as it finds it
  eprosima::fastcdr::FastBuffer to{room.data(), room.size()};
  Cdr out{to, order == std::endian::big ? Cdr::BIG_ENDIANNESS : Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR};
  out.serialize_encapsulation();
  Walk{tree, in, out}.message(tree.root());
  std::vector<std::byte> result(out.getSerializedDataLength());
  std::memcpy(result.data(), room.data(), result.size());
  return result;
}

}  // namespace trestle::test
