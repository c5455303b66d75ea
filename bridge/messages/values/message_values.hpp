// bridge/messages/values: messages as text that people write and read, YAML and JSON.
//
//   message_values.hpp  text to payload, payload to text
//   sample_builder.hpp  text to CDR; sample_walk.hpp: through CDR, value by value
//   printers.hpp        as YAML, as JSON
//   words.hpp           what people call fields and values
//   text_value.hpp      a piece of YAML or JSON before its type is known
//   load_wire.hpp       the section `wire` of a configuration
//
// docs/values.md describes the text.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/values/text_value.hpp"
#include "bridge/messages/values/words.hpp"

/// Messages as text that people read and write. docs/values.md describes the text.
namespace trestle::messages {

/// The language that a message is printed in.
enum class ValueForm : std::uint8_t {
  yaml,  ///< as `ros2 topic echo` prints, ending in a line end
  json,  ///< one line, without its end
};

/// How byte, char and uint8 arrays are printed.
enum class BytesForm : std::uint8_t {
  list,    ///< of numbers, like other arrays
  base64,  ///< one string; in YAML tagged !!binary
  hex,     ///< one string, "hex:00ff"
};

/// How a message is printed; the default loses nothing.
struct PrintOptions {
  BytesForm bytes = BytesForm::list;
  /// Of longer arrays and strings only the beginning is printed, and "..."; counted in elements and bytes.
  /// Such text cannot be read back. 0: everything is printed.
  std::size_t longest = 0;
};

/// Printed text would have more than this many bytes.
inline constexpr std::size_t max_printed_bytes = std::size_t{256} << 20U;
/// Text that would become a larger sample is refused.
inline constexpr std::size_t max_sample_bytes = std::size_t{256} << 20U;

/// A message type and the wire rules of a service, compiled for going between payloads and text.
class MessageValues {
 public:
  /// @return the values, or one line that says why the type cannot be carried under these rules.
  [[nodiscard]] static tl::expected<MessageValues, std::string> make(TypeTree tree,
                                                                     const MessageRules& rules = {});
  /// The same in other words than those of the type: texts have them in both directions.
  [[nodiscard]] static tl::expected<MessageValues, std::string> make(TypeTree tree, const MessageRules& rules,
                                                                     Words words);

  /// What is wrong with a payload; nothing: it is a message of the type. The field is named as in texts.
  [[nodiscard]] std::optional<ConversionError> fault_of(ByteView payload) const;

  /// The text of a SOME/IP payload, or one line that says what is wrong with it and where.
  [[nodiscard]] tl::expected<std::string, std::string> print(ByteView payload, ValueForm form,
                                                             const PrintOptions& options = {}) const;
  /// The same of a CDR sample with its encapsulation header, as DDS carries it.
  [[nodiscard]] tl::expected<std::string, std::string> print_sample(ByteView sample, ValueForm form,
                                                                    const PrintOptions& options = {}) const;

  /// The payload that a text describes. Fields that it does not mention have the default value of the .msg
  /// file, or zero.
  /// @return the payload; or the first thing that is wrong with the text.
  [[nodiscard]] tl::expected<std::vector<std::byte>, ValueError> parse(std::string_view text,
                                                                       ValueForm form) const;
  /// The payload of a message of which nothing is said: default values, or zeros, and of a choice its first
  /// member.
  [[nodiscard]] tl::expected<std::vector<std::byte>, ValueError> initial() const;
  /// parse() as a CDR sample, in the host's byte order.
  [[nodiscard]] tl::expected<std::vector<std::byte>, ValueError> parse_sample(std::string_view text,
                                                                              ValueForm form) const;

  [[nodiscard]] const TypeTree& tree() const noexcept { return tree_; }
  /// Null: those of the type.
  [[nodiscard]] const Words* words() const noexcept { return words_ ? &*words_ : nullptr; }

 private:
  [[nodiscard]] tl::expected<std::vector<std::byte>, ValueError> to_payload(
      const tl::expected<std::vector<std::byte>, ValueError>& sample, const TextValue& text) const;
  MessageValues(TypeTree tree, ConversionPlan plan, std::optional<Words> words)
      : tree_{std::move(tree)}, plan_{std::move(plan)}, words_{std::move(words)} {}

  [[nodiscard]] ConversionError in_words(ConversionError error) const;

  TypeTree tree_;
  ConversionPlan plan_;
  std::optional<Words> words_;
};

}  // namespace trestle::messages
