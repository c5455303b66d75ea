#include "sd/core/receive_buffer.hpp"

#include <limits>

namespace trestle::sd {
namespace {

std::uint32_t number_in(std::string_view text) noexcept {
  constexpr std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t number = 0;
  for (const char digit : text) {
    if (digit < '0' || digit > '9') {
      return 0;
    }
    const auto unit = static_cast<std::uint32_t>(digit - '0');
    number = number > (most - unit) / 10 ? most : 10 * number + unit;
  }
  return number;
}

// In decimal digits.
class NumberText {
 public:
  explicit NumberText(std::uint32_t number) noexcept {
    do {
      digits_[--first_] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number > 0);
  }
  [[nodiscard]] std::string_view view() const noexcept {
    return {digits_.data() + first_, digits_.size() - first_};
  }

 private:
  std::array<char, 10> digits_{};  // from the last one on
  std::size_t first_ = digits_.size();
};

}  // namespace

ReceiveBufferOption::ReceiveBufferOption(std::uint32_t bytes) noexcept {
  const NumberText number{bytes};
  const std::array items{ConfigurationItem{receive_buffer_key, number.view()}};
  const auto option = encode_configuration(items, body_);
  size_ = option ? option->body.size() : 0;  // it always fits
}

NodeToldOption::NodeToldOption(const NodeTold& told) noexcept {
  const std::array numbers{NumberText{told.receive_buffer_bytes}, NumberText{told.question},
                           NumberText{told.answer}};
  std::array<ConfigurationItem, 3> items{};
  std::size_t count = 0;
  const auto add = [&](std::string_view key, std::uint32_t number, const NumberText& text) {
    if (number != 0) {
      items[count++] = {key, text.view()};
    }
  };
  add(receive_buffer_key, told.receive_buffer_bytes, numbers[0]);
  add(question_key, told.question, numbers[1]);
  add(answer_key, told.answer, numbers[2]);
  const auto option = encode_configuration(std::span{items}.first(count), body_);
  size_ = option ? option->body.size() : 0;  // it always fits
}

NodeTold told_in(const SdMessage& message) noexcept {
  NodeTold told;
  OptionCursor options = message.options();
  while (const auto option = options.next()) {
    if (option->type != OptionType::configuration) {
      continue;
    }
    ConfigurationCursor configuration{*option};
    while (const auto item = configuration.next()) {
      const auto take = [&](std::string_view key, std::uint32_t& number) {
        if (item->key == key && item->value && number == 0) {
          number = number_in(*item->value);
        }
      };
      take(receive_buffer_key, told.receive_buffer_bytes);
      take(question_key, told.question);
      take(answer_key, told.answer);
    }
  }
  return told;
}

std::uint32_t receive_buffer_in(ConfigurationCursor configuration) noexcept {
  while (const auto item = configuration.next()) {
    if (item->key == receive_buffer_key) {
      return item->value ? number_in(*item->value) : 0;
    }
  }
  return 0;
}

}  // namespace trestle::sd
