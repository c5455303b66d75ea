#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"

/// What people call the fields and values of a message, where an interface description says more than a ROS
/// definition can. docs/values.md says what the text looks like then.
namespace trestle::messages {

/// The names of the values of an enumeration.
class Enumerators {
 public:
  using Pair = std::pair<std::string, std::int64_t>;

  /// @param all  those of an uint64 are the same 64 bits. Of several names of one value the first is printed.
  explicit Enumerators(std::vector<Pair> all);

  [[nodiscard]] const std::vector<Pair>& all() const noexcept { return all_; }
  /// Null: there is none.
  [[nodiscard]] const Pair* by_value(std::int64_t value) const;
  [[nodiscard]] const Pair* by_name(const std::string& name) const;

 private:
  std::vector<Pair> all_;
  std::unordered_map<std::int64_t, std::size_t> values_;
  std::unordered_map<std::string, std::size_t> names_;
};

/// Of a field.
struct FieldWords {
  enum class Form : std::uint8_t {
    plain,     ///< as the ROS definition has it
    optional,  ///< a T[<=1] that is a T, or missing
    entries,   ///< a map: an array of messages with the fields `key` and `value`
    bytes,     ///< a byte buffer: one string
  };
  Form form = Form::plain;
  std::string name{};  ///< in place of the field's; empty: the same
  /// Of an integer, or of those in an array; null: it has none.
  std::shared_ptr<const Enumerators> enumerators{};
  friend bool operator==(const FieldWords&, const FieldWords&) = default;
};

/// Of a message.
struct MessageWords {
  enum class Form : std::uint8_t {
    structure,
    choice,   ///< of its fields, each a T[<=1], exactly one is there
    wrapper,  ///< it is its only field, which is an array
  };
  Form form = Form::structure;
  std::vector<FieldWords> fields{};  ///< of each field of the definition, or none at all
  friend bool operator==(const MessageWords&, const MessageWords&) = default;
};

/// Of all messages by "pkg/msg/Type".
using WordsOfTypes = std::map<std::string, MessageWords, std::less<>>;

/// Of a payload.
struct Words {
  std::string name{};  ///< of what carries it, for messages: "Door.moved"; empty: that of its type
  /// The message itself is the value of this name: an argument that is a structure. Empty: its fields are the
  /// values.
  std::string argument{};
  std::vector<MessageWords> messages{};  ///< of each message of a TypeTree; or none at all

  /// Those of a message; the last one's if there are none.
  [[nodiscard]] const MessageWords& of(std::size_t message) const noexcept {
    return message < messages.size() ? messages[message] : nothing;
  }
  static const MessageWords nothing;
};

/// Those of a field, which may have none.
[[nodiscard]] const FieldWords& words_of(const MessageWords& words, std::size_t field) noexcept;
/// The name by which people call it.
[[nodiscard]] const std::string& name_of(const MessageWords& words, const MessageDefinition& type,
                                         std::size_t field) noexcept;
/// Null: the value has no name.
[[nodiscard]] const std::string* enumerator_of(const FieldWords& words, std::int64_t value);
/// "fields[3].name" of a conversion's error in the words of people.
[[nodiscard]] std::string in_words(std::string_view field, const TypeTree& tree, const Words& words);

}  // namespace trestle::messages
