#pragma once
#include <string_view>

#include "bridge/messages/convert/program/output.hpp"
#include "bridge/messages/convert/program/program.hpp"

namespace trestle::messages {

/// The default of a field that has one, which the parser of .msg files has checked.
[[nodiscard]] DefaultValue default_value_of(const Field& field);

/// Writes the CDR of fields that an older sender's payload does not have.  [feat_req_someipcompat_1200]
class DefaultWriter {
 public:
  DefaultWriter(const Program& program, Output& out) : program_{program}, out_{out} {}

  /// Writes the default of a field or member: that of its `.msg` file, or zeros and empty arrays.
  /// @return false: all defaults of this message together take more than max_default_bytes.
  [[nodiscard]] bool write(std::size_t i);

 private:
  bool zeros(std::size_t begin, std::size_t end);
  bool value(const DefaultValue& value);
  bool text(std::string_view text, bool wide);
  void wide_characters(ByteView text);
  bool zero_numbers(std::uint64_t count, std::size_t width);
  /// Takes note of that many bytes; a message of few bytes must not become one of very many.
  [[nodiscard]] bool spend(std::size_t bytes) noexcept;

  const Program& program_;
  Output& out_;
  std::size_t spent_ = 0;
};

}  // namespace trestle::messages
