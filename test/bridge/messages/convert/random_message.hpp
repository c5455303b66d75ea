#pragma once
#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::test {

/// Of a random message, at most.
struct RandomSizes {
  std::uint32_t elements = 4;
  std::uint32_t text = 19;
};

/// Writes good CDR samples of a type. Those with the same `form` differ in nothing but numbers: they have the
/// same texts, counts, booleans and alternatives of unions.
class RandomMessage {
 public:
  RandomMessage(const messages::TypeTree& tree, std::endian order, unsigned form, unsigned numbers,
                const messages::MessageRules& rules = {}, const RandomSizes& sizes = {})
      : tree_{tree}, rules_{rules}, sizes_{sizes}, order_{order}, form_{form}, numbers_{numbers} {
    bytes_ = {std::byte{0}, static_cast<std::byte>(order == std::endian::little), std::byte{0}, std::byte{0}};
    message(tree.root());
  }

  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::uint32_t pick(std::uint32_t below) { return static_cast<std::uint32_t>(form_()) % below; }

  void message(const messages::MessageDefinition& definition) {
    const auto rules = rules_.types.find(definition.name);
    const bool is_union =
        rules != rules_.types.end() && rules->second.form == messages::TypeRules::Form::choice;
    std::uint32_t alternative = is_union ? pick(static_cast<std::uint32_t>(definition.fields.size())) : 0;
    if (definition.fields.empty()) {
      number(1);
    }
    for (const messages::Field& field : definition.fields) {
      bits_ = 0;
      if (rules != rules_.types.end() && rules->second.fields.contains(field.name)) {
        bits_ = rules->second.fields.at(field.name).bits;
      }
      if (is_union) {
        const bool is_it = alternative-- == 0;
        length(is_it ? 1 : 0);
        if (is_it) {
          single(field.type);
        }
        continue;
      }
      array(field.type);
    }
  }

  void array(const messages::FieldType& type) {
    using Kind = messages::ArrayKind;
    std::uint32_t count = type.array == Kind::none ? 1 : type.array_size;
    if (type.array == Kind::bounded || type.array == Kind::unbounded) {
      count = pick(
          (type.array == Kind::bounded ? std::min(type.array_size, sizes_.elements) : sizes_.elements) + 1);
      length(count);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      single(type);
    }
  }

  void single(const messages::FieldType& type) {
    using messages::Primitive;
    if (!type.primitive) {
      return message(tree_.messages[type.message_index]);
    }
    const bool is_text = *type.primitive == Primitive::string || *type.primitive == Primitive::wstring;
    const std::uint32_t size =
        is_text ? pick((type.string_bound == 0 ? sizes_.text : std::min(sizes_.text, type.string_bound)) + 1)
                : 0;
    switch (*type.primitive) {
      case Primitive::string:
        length(size + 1);
        for (std::uint32_t i = 0; i < size; ++i) {
          bytes_.push_back(static_cast<std::byte>('a' + pick(26)));
        }
        bytes_.push_back(std::byte{0});
        return;
      case Primitive::wstring:
        length(size);
        for (std::uint32_t i = 0; i < size; ++i) {
          length(0x3b1 + pick(20));
        }
        return;
      case Primitive::boolean:
        bytes_.push_back(static_cast<std::byte>(pick(2)));
        return;
      default:
        if (bits_ == 0) {
          return number(messages::width(*type.primitive));
        }
        few_bits(messages::width(*type.primitive));
    }
  }

  void align(std::size_t width) { bytes_.resize((bytes_.size() - 4 + width - 1) / width * width + 4); }

  void length(std::uint32_t value) {
    align(4);
    for (unsigned i = 0; i < 4; ++i) {
      const unsigned shift = order_ == std::endian::little ? 8 * i : 24 - 8 * i;
      bytes_.push_back(static_cast<std::byte>(value >> shift));
    }
  }

  /// A number that has room in the field's bits, whether it has a sign or not.
  void few_bits(std::size_t width) {
    align(width);
    const std::uint64_t value = numbers_() & ((std::uint64_t{1} << (bits_ - 1U)) - 1);
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t shift = order_ == std::endian::little ? 8 * i : 8 * (width - 1 - i);
      bytes_.push_back(static_cast<std::byte>(value >> shift));
    }
  }

  // Often the same as in other messages, as those of the fields of a cloud.
  void number(std::size_t width) {
    align(width);
    const bool is_usual = numbers_() % 2 == 0;
    for (std::size_t i = 0; i < width; ++i) {
      bytes_.push_back(static_cast<std::byte>(is_usual ? 7 : numbers_()));
    }
  }

  const messages::TypeTree& tree_;
  const messages::MessageRules rules_;
  RandomSizes sizes_;
  unsigned bits_ = 0;  ///< of the numbers in the present field; 0: all
  std::endian order_;
  std::minstd_rand form_;
  std::minstd_rand numbers_;
  std::vector<std::byte> bytes_;
};

}  // namespace trestle::test
