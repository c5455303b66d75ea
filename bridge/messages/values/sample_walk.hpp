#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/values/words.hpp"
#include "someip/wire/types.hpp"

namespace trestle::messages {

/// Is told what a sample holds, in order. Whoever does not care overrides nothing.
class ValueSink {
 public:
  virtual ~ValueSink() = default;
  virtual void begin_message(const MessageDefinition& /*type*/) {}
  virtual void field(const std::string& /*name*/) {}
  virtual void end_message(const MessageDefinition& /*type*/) {}
  /// @param numbers  elements are numbers, bools or enumerators.
  /// @param size     of the whole array.
  /// @param shown    how many elements follow; fewer than `size` when the array is cut.
  virtual void begin_array(bool /*numbers*/, std::size_t /*size*/, std::size_t /*shown*/) {}
  virtual void element() {}
  virtual void end_array() {}

  virtual void boolean(bool /*value*/) {}
  virtual void whole(std::int64_t /*value*/) {}
  virtual void natural(std::uint64_t /*value*/) {}
  virtual void float32(float /*value*/) {}
  virtual void float64(double /*value*/) {}
  /// @param text  perhaps not valid UTF-8.
  /// @param size  of the whole string in bytes; more than `text` has when it is cut.
  virtual void string(std::string_view /*text*/, std::size_t /*size*/) {}
  /// An array of byte, char or uint8, if WalkOptions asks for it.
  virtual void bytes(ByteView /*bytes*/, std::size_t /*size*/) {}
  /// True ends the walk early.
  [[nodiscard]] virtual bool enough() const { return false; }
};

/// How much of a sample a ValueSink is told.
struct WalkOptions {
  bool bytes_as_one = false;  ///< bytes() instead of an array of numbers
  std::size_t longest = 0;    ///< elements of an array and bytes of a string to tell; 0: all
  /// Names of fields and values: enumerators are told as strings, what is missing is not told at all, byte
  /// buffers always come as bytes(). Null: those of the types.
  const Words* words = nullptr;
};

/// Tells `sink` what a CDR sample of the root type of `tree` holds.
/// @param sample  with its encapsulation header, in either byte order.
/// @return nothing; or what is wrong with the sample. The sink has then been given everything before that
///         place.
[[nodiscard]] std::optional<std::string> walk_sample(ByteView sample, const TypeTree& tree,
                                                     const WalkOptions& options, ValueSink& sink);

}  // namespace trestle::messages
