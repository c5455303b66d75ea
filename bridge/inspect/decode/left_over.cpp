#include "bridge/inspect/decode/left_over.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/convert/program/wire_forms.hpp"

namespace trestle::inspect {
namespace {

using messages::MessageValues;
using Part = describe::ServiceElement::Part;

/// The wire rules of a content; null: it has no form in ROS.
const messages::MessageRules* rules_of(const describe::Interfaces& interfaces,
                                       const describe::ServiceElement& element,
                                       const describe::Content& content) {
  using Kind = describe::LoweredMember::Kind;
  const Kind kind = element.part == Part::event    ? Kind::event
                    : element.part == Part::method ? Kind::method
                                                   : Kind::field;
  const describe::LoweredMember* const lowered =
      interfaces.system().lowered.member(kind, element.service, element.member);
  if (lowered == nullptr) {
    return nullptr;
  }
  const bool is_response = element.part == Part::method && &content == &interfaces.answer(element);
  return is_response ? &lowered->response : &lowered->rules;
}

/// Whether the values of a payload are all in its first bytes: they are the same without the rest, and
/// whatever stands there. That the first bytes are a message, too, is not enough, as some rules let fields be
/// missing.
class Values {
 public:
  Values(const MessageValues& values, ByteView payload)
      : values_{values}, payload_{payload}, printed_{values.print(payload, form)} {}

  [[nodiscard]] bool are_in(std::size_t size) const {
    return values_.print(payload_.first(size), form) == printed_ && are_without(size, std::byte{0x00}) &&
           are_without(size, std::byte{0xff});
  }

 private:
  static constexpr messages::ValueForm form = messages::ValueForm::json;

  [[nodiscard]] bool are_without(std::size_t size, std::byte filler) const {
    std::vector<std::byte> other{payload_.begin(), payload_.end()};
    std::fill(other.begin() + static_cast<std::ptrdiff_t>(size), other.end(), filler);
    return values_.print(other, form) == printed_;
  }

  const MessageValues& values_;
  ByteView payload_;
  tl::expected<std::string, std::string> printed_;
};

/// The least size up to `most` for which something is true, which is so for `most` and for all that are
/// larger than one for which it is.
template <typename Condition>
std::size_t least_size(std::size_t most, Condition is_true) {
  std::size_t least = 0;
  while (least < most) {
    const std::size_t middle = least + (most - least) / 2;
    if (is_true(middle)) {
      most = middle;
    } else {
      least = middle + 1;
    }
  }
  return most;
}

/// How many bytes at the beginning of a payload are needed for its values.
std::size_t needed(const MessageValues& values, ByteView payload) {
  // Printing so much again and again takes too long.
  constexpr std::size_t most_searched = std::size_t{64} << 10U;
  const std::size_t all = payload.size();
  const auto fits = [&](std::size_t size) { return !values.fault_of(payload.first(size)); };
  if (all == 0 || !fits(all) || !fits(all - 1)) {
    return all;
  }
  const Values wanted{values, payload};
  if (!wanted.are_in(all - 1)) {
    return all;
  }
  const std::size_t fitting = least_size(all - 1, fits);
  if (wanted.are_in(fitting)) {
    return fitting;
  }
  return all > most_searched ? all
                             : least_size(all - 1, [&](std::size_t size) { return wanted.are_in(size); });
}

}  // namespace

std::optional<LeftOver> left_over(const describe::Interfaces& interfaces,
                                  const describe::ServiceElement& element, const describe::Content& content,
                                  ByteView payload, bool has_header) {
  const std::size_t header = has_header ? content.e2e.bytes : 0;
  if (payload.size() < header || (!content.is_empty && !content.values)) {
    return std::nullopt;
  }
  const std::vector<std::byte> rest =
      has_header ? content.without_header(payload) : std::vector<std::byte>{payload.begin(), payload.end()};
  std::size_t end = 0;
  if (!content.is_empty) {
    const messages::MessageRules* const rules = rules_of(interfaces, element, content);
    if (rules == nullptr) {
      return std::nullopt;
    }
    end = needed(*content.values, rest);
    // Padding behind the last value belongs to it.
    end += std::min(messages::padding(end, rules->payload.alignment), rest.size() - end);
  }
  if (end == rest.size()) {
    return std::nullopt;
  }
  return LeftOver{end + (end >= content.e2e.at ? header : 0), rest.size() - end};
}

std::string to_string(const LeftOver& left_over) {
  return fmt::format("{} byte{} left over at offset {}", left_over.bytes, left_over.bytes == 1 ? "" : "s",
                     left_over.offset);
}

Json to_json(const LeftOver& left_over) {
  Json object;
  object["offset"] = left_over.offset;
  object["bytes"] = left_over.bytes;
  object["detail"] = to_string(left_over);
  return object;
}

}  // namespace trestle::inspect
