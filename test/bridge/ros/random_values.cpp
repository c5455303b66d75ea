#include "test/bridge/ros/random_values.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace trestle::test {
namespace {

using namespace bridge;
using Json = nlohmann::json;

class Maker {
 public:
  Maker(const TypeTree& tree, std::mt19937& random) : tree_{tree}, random_{random} {}

  Json message(const MessageDefinition& definition) {
    Json values = Json::object();
    for (const Field& field : definition.fields) {
      values[field.name] = value(field.type);
    }
    return values;
  }

 private:
  std::uint32_t up_to(std::uint32_t most) { return static_cast<std::uint32_t>(random_()) % (most + 1); }

  Json value(const FieldType& type) {
    if (type.array == ArrayKind::none) {
      return type.primitive ? primitive(*type.primitive, type.string_bound)
                            : message(tree_.messages[type.message_index]);
    }
    const std::uint32_t count = type.array == ArrayKind::fixed ? type.array_size
                                : type.array == ArrayKind::bounded
                                    ? up_to(std::min(std::uint32_t{3}, type.array_size))
                                    : up_to(3);
    FieldType element = type;
    element.array = ArrayKind::none;
    Json list = Json::array();
    for (std::uint32_t i = 0; i < count; ++i) {
      list.push_back(value(element));
    }
    return list;
  }

  Json primitive(Primitive type, std::uint32_t bound) {
    const auto bits = (std::uint64_t{random_()} << 32U) | random_();
    switch (type) {
      case Primitive::boolean:
        return bits % 2 == 1;
      case Primitive::byte:
      case Primitive::character:
      case Primitive::uint8:
        return static_cast<std::uint8_t>(bits);
      case Primitive::int8:
        return static_cast<std::int8_t>(bits);
      case Primitive::int16:
        return static_cast<std::int16_t>(bits);
      case Primitive::uint16:
        return static_cast<std::uint16_t>(bits);
      case Primitive::int32:
        return static_cast<std::int32_t>(bits);
      case Primitive::uint32:
        return static_cast<std::uint32_t>(bits);
      case Primitive::int64:
        return static_cast<std::int64_t>(bits);
      case Primitive::uint64:
        return bits;
      case Primitive::float32: {
        const auto number = std::bit_cast<float>(static_cast<std::uint32_t>(bits));
        return std::isfinite(number) ? number : 0.5F;
      }
      case Primitive::float64: {
        const auto number = std::bit_cast<double>(bits);
        return std::isfinite(number) ? number : -0.5;
      }
      case Primitive::string:
      case Primitive::wstring:
        break;
    }
    // Of the last one UTF-8 needs four bytes and UTF-16 two units.
    constexpr std::array<const char*, 5> characters{"a", " ", "\u00e4", "\u20ac", "\U0001f600"};
    std::string text;
    std::uint32_t units = 0;
    for (std::uint32_t left = up_to(6); left > 0; --left) {
      const std::uint32_t at = up_to(4);
      const std::uint32_t more =
          type == Primitive::wstring ? 1 + at / 4 : static_cast<std::uint32_t>(std::strlen(characters[at]));
      if (bound == 0 || units + more <= bound) {
        text += characters[at];
        units += more;
      }
    }
    return text;
  }

  const TypeTree& tree_;
  std::mt19937& random_;
};

}  // namespace

Json random_values(const TypeTree& tree, std::mt19937& random) {
  return Maker{tree, random}.message(tree.root());
}

}  // namespace trestle::test
