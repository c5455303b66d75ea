#pragma once
#include <bit>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/model.hpp"

/// What the bytes of a type are, in words.
namespace trestle::describe::comparing {

[[nodiscard]] bool is_type(const Model& model, TypeIndex index);

/// The rules of a use that matter for its kind, in words.
[[nodiscard]] std::string rules_of(Kind kind, const Wire& wire);

/// What to call a type: its name, or what it is: "uint8[]".
[[nodiscard]] std::string name_of(const Model& model, TypeIndex index);

[[nodiscard]] std::string_view word_of(std::endian order);

/// byte and char of ROS are one unsigned byte.
[[nodiscard]] messages::Primitive on_wire(messages::Primitive primitive);

[[nodiscard]] bool is_number(const Type& type);

/// A byte buffer, or an array of numbers of one byte.
[[nodiscard]] bool is_bytes(const Model& model, const Type& type);

/// One of two payloads that are compared: what its bytes are, in words.
class Side {
 public:
  explicit Side(const Model& model) : model_{&model} {}
  Side(const Model& model, const Payload& payload, std::string element)
      : model_{&model}, payload_{&payload}, element_{std::move(element)}, order_{payload.byte_order} {}

  /// Takes the byte order of a use, for what is in it; returns the one before.
  std::endian enter(const Value& use) { return std::exchange(order_, use.wire.byte_order.value_or(order_)); }
  void leave(std::endian order) { order_ = order; }

  /// "Angle (uint16, 16 bits, big endian, at byte 4)"
  std::string bytes_of(const std::string& element, const Value& use);

 private:
  /// "at byte 4 + name"; empty: it has no place of its own, or too many were asked for.
  std::string offset_of(const std::string& element);

  /// Of one payload: each one is looked for in all of its ranges.
  static constexpr std::size_t max_offsets = 100;
  const Model* model_;
  const Payload* payload_ = nullptr;
  std::string element_{};
  std::endian order_ = std::endian::big;
  std::size_t asked_ = 0;
  std::vector<ByteRange> ranges_{};
};

}  // namespace trestle::describe::comparing
