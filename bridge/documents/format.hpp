#pragma once
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

/// How values are written in the configuration: from text to value, knowing nothing of YAML.
namespace trestle::documents {

/// What values of one kind look like, for other programs: by it a JSON Schema says what an editor may offer.
/// It takes all that the format reads, and perhaps more.
struct Shape {
  enum class Kind : std::uint8_t { text, words, number, time, size };
  Kind kind = Kind::text;
  std::uint64_t min = 0;  ///< of a number or a size in bytes; of a time, 0 stands for "0 is good"
  std::uint64_t max = ~std::uint64_t{0};
  std::vector<std::string> words{};  ///< all that there are, or those that may stand in place of a number
  std::string pattern{};             ///< of a text, as ECMAScript has it; empty: any
};

/// How values of one kind are written, and how they are named when something else stands there.
template <typename T>
struct Format {
  std::string expected;  ///< completes "expected ...": "a whole number from 1 to 10000"
  std::function<std::optional<T>(std::string_view)> read;  ///< nothing: it is not what was expected
  Shape shape{};
};

/// Decimal, or hexadecimal after "0x". A leading zero is refused: some YAML readers would take it as octal.
[[nodiscard]] std::optional<std::uint64_t> read_whole(std::string_view text);

/// "from 1 to 10000"
[[nodiscard]] Format<std::uint64_t> whole_number(std::uint64_t min, std::uint64_t max);
/// "0x1234" or 4660.
[[nodiscard]] Format<std::uint64_t> id_number(std::uint64_t min, std::uint64_t max);
/// "true" or "false".
[[nodiscard]] Format<bool> truth();
/// "30 ms", "1.5 s", "0"; the units are ns, us, ms, s.
[[nodiscard]] Format<Duration> duration(Duration min, Duration max);
/// "16 MiB", "64 KiB", "1400": the units are B, KiB and MiB; none is bytes.
[[nodiscard]] Format<std::uint64_t> byte_size(std::uint64_t min, std::uint64_t max);
/// IPv4 or IPv6, not the unspecified one.
[[nodiscard]] Format<IpAddress> ip_address();
/// One of a group.
[[nodiscard]] Format<IpAddress> multicast_address();
/// A text of which this is true.
/// @param pattern  that all such texts have: Shape.
[[nodiscard]] Format<std::string> text_that(std::string expected, bool (*is_good)(std::string_view text),
                                            std::string pattern = {});
/// Any text that is not empty.
[[nodiscard]] Format<std::string> any_text(std::string expected);

/// "30 ms", "1.5 s", as read by duration().
[[nodiscard]] std::string to_string(Duration duration);
/// "16 MiB", as read by byte_size().
[[nodiscard]] std::string bytes_to_string(std::uint64_t bytes);

/// One word of several, each with its meaning.
template <typename T>
[[nodiscard]] Format<T> one_of(std::initializer_list<std::pair<const char*, T>> words) {
  std::string expected = words.size() > 1 ? "one of " : "";
  Shape shape{.kind = Shape::Kind::words};
  for (const auto& [word, meaning] : words) {
    expected += (&word == &words.begin()->first ? "" : ", ") + std::string{word};
    shape.words.emplace_back(word);
  }
  return {std::move(expected),
          [words = std::vector(words)](std::string_view text) -> std::optional<T> {
            for (const auto& [word, meaning] : words) {
              if (text == word) {
                return meaning;
              }
            }
            return std::nullopt;
          },
          std::move(shape)};
}

/// The same text, with its value put into another type.
template <typename T, typename From>
[[nodiscard]] Format<T> as(Format<From> format) {
  return {std::move(format.expected),
          [read = std::move(format.read)](std::string_view text) {
            const auto number = read(text);
            return number ? std::optional<T>{static_cast<T>(*number)} : std::nullopt;
          },
          std::move(format.shape)};
}

}  // namespace trestle::documents
