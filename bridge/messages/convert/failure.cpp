#include "bridge/messages/convert/failure.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/messages/convert/expectation.hpp"

namespace trestle::messages {

ConversionError Failure::error(const Program& program, bool to_cdr, ByteView in) const {
  const ByteView left = in.subspan(std::min(offset_, in.size()));
  ConversionError error{fault_, offset_, {}, expectation(program, fault_, op_, to_cdr, left)};
  if (op_ >= program.labels.size()) {
    return error;
  }
  error.is_wide = program.ops[op_].kind == Op::Kind::wstring;
  const auto& labels = program.labels[op_];
  const std::uint64_t element = element_ == no_element ? 0 : element_;
  const auto after = std::ranges::upper_bound(labels, element, {}, &Label::first);
  const Label& label = *std::prev(after);
  std::size_t loop = loops_;
  std::string_view rest = label.path;
  for (auto at = rest.find("[]"); at != std::string_view::npos; at = rest.find("[]")) {
    error.field += rest.substr(0, at);
    error.field += fmt::format("[{}]", loop > 0 ? indices_[--loop] : 0);
    rest.remove_prefix(at + 2);
  }
  error.field += rest;
  if (label.stride != 0 && element_ != no_element) {
    error.field += fmt::format("[{}]", (element - label.first) / label.stride);
  }
  return error;
}

ConversionError error_of_message(const Program& program, ConversionFault fault, bool to_cdr, ByteView in) {
  return {fault, 0, {}, expectation(program, fault, Program::no_op, to_cdr, in)};
}

}  // namespace trestle::messages
