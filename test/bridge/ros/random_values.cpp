#include "test/bridge/ros/random_values.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace trestle::test {
namespace {

using namespace messages;
using Json = nlohmann::json;

class Maker {
 public:
  Maker(const messages::TypeTree& tree, std::mt19937& random) : tree_{tree}, random_{random} {}

  Json message(const messages::MessageDefinition& definition) {
    Json values = Json::object();
    for (const messages::Field& field : definition.fields) {
      values[field.name] = value(field.type);
    }
    return values;
  }

 private:
  std::uint32_t up_to(std::uint32_t most) { return static_cast<std::uint32_t>(random_()) % (most + 1); }

  Json value(const messages::FieldType& type) {
    if (type.array == messages::ArrayKind::none) {
      return type.primitive ? primitive(*type.primitive, type.string_bound)
                            : message(tree_.messages[type.message_index]);
    }
    const std::uint32_t count = type.array == messages::ArrayKind::fixed ? type.array_size
                                : type.array == messages::ArrayKind::bounded
                                    ? up_to(std::min(std::uint32_t{3}, type.array_size))
                                    : up_to(3);
    messages::FieldType element = type;
    element.array = messages::ArrayKind::none;
    Json list = Json::array();
    for (std::uint32_t i = 0; i < count; ++i) {
      list.push_back(value(element));
    }
    return list;
  }

  Json primitive(messages::Primitive type, std::uint32_t bound) {
    const auto bits = (std::uint64_t{random_()} << 32U) | random_();
    switch (type) {
      case messages::Primitive::boolean:
        return bits % 2 == 1;
      case messages::Primitive::byte:
      case messages::Primitive::character:
      case messages::Primitive::uint8:
        return static_cast<std::uint8_t>(bits);
      case messages::Primitive::int8:
        return static_cast<std::int8_t>(bits);
      case messages::Primitive::int16:
        return static_cast<std::int16_t>(bits);
      case messages::Primitive::uint16:
        return static_cast<std::uint16_t>(bits);
      case messages::Primitive::int32:
        return static_cast<std::int32_t>(bits);
      case messages::Primitive::uint32:
        return static_cast<std::uint32_t>(bits);
      case messages::Primitive::int64:
        return static_cast<std::int64_t>(bits);
      case messages::Primitive::uint64:
        return bits;
      case messages::Primitive::float32: {
        const auto number = std::bit_cast<float>(static_cast<std::uint32_t>(bits));
        return std::isfinite(number) ? number : 0.5F;
      }
      case messages::Primitive::float64: {
        const auto number = std::bit_cast<double>(bits);
        return std::isfinite(number) ? number : -0.5;
      }
      case messages::Primitive::string:
      case messages::Primitive::wstring:
        break;
    }
    // Of the last one UTF-8 needs four bytes and UTF-16 two units.
    constexpr std::array<const char*, 5> characters{"a", " ", "\u00e4", "\u20ac", "\U0001f600"};
    std::string text;
    std::uint32_t units = 0;
    for (std::uint32_t left = up_to(6); left > 0; --left) {
      const std::uint32_t at = up_to(4);
      const std::uint32_t more = type == messages::Primitive::wstring
                                     ? 1 + at / 4
                                     : static_cast<std::uint32_t>(std::strlen(characters[at]));
      if (bound == 0 || units + more <= bound) {
        text += characters[at];
        units += more;
      }
    }
    return text;
  }

  const messages::TypeTree& tree_;
  std::mt19937& random_;
};

}  // namespace

Json random_values(const messages::TypeTree& tree, std::mt19937& random) {
  return Maker{tree, random}.message(tree.root());
}

}  // namespace trestle::test
