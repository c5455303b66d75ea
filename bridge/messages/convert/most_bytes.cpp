#include "bridge/messages/convert/most_bytes.hpp"

#include <limits>

#include "someip/wire/tp.hpp"

namespace trestle::messages {
namespace {

using Bytes = std::optional<std::uint64_t>;

constexpr std::uint64_t unbounded = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t too_many = std::uint64_t{1} << 31U;

Bytes times(std::uint64_t count, Bytes each) {
  return !each || (*each != 0 && count > too_many / *each) ? std::nullopt : Bytes{count * *each};
}

/// Of the operations in [from, to).
Bytes most_of(const Program& program, std::size_t from, std::size_t to) {
  const someip::PayloadRules& rules = program.rules;
  std::uint64_t sum = 0;
  for (std::size_t i = from; i < to;) {
    const Op& op = program.ops[i];
    const std::size_t next = op.end > i ? op.end : i + 1;
    const std::uint64_t around = bytes(op.length) + rules.alignment;
    Bytes most;
    switch (op.kind) {
      case Op::Kind::numbers:
        most = times(op.count, op.width);
        break;
      case Op::Kind::bools:
        most = times(op.count, 1);
        break;
      case Op::Kind::bits:
        most = op.width;
        break;
      case Op::Kind::packed:
        most = op.fixed_bytes;
        break;
      case Op::Kind::string:
      case Op::Kind::wstring:
        // In any encoding, with BOM and terminator.
        most = op.fixed_bytes != 0     ? around + op.fixed_bytes
               : op.bound >= unbounded ? Bytes{}
                                       : times(4, op.bound + 2);
        most = most ? *most + around : most;
        break;
      case Op::Kind::number_sequence:
      case Op::Kind::bool_sequence:
      case Op::Kind::sequence:
        if (op.bound < unbounded && !rules.cut_longer_arrays) {
          most = op.kind == Op::Kind::sequence ? most_of(program, i + 1, op.end) : times(op.count, op.width);
          most = times(op.bound, most);
          most = most ? *most + around : most;
        }
        break;
      case Op::Kind::repeat:
        most = times(op.count, most_of(program, i + 1, op.end));
        break;
      case Op::Kind::field:
        most = most_of(program, i + 1, op.end);
        break;
      case Op::Kind::structure:
      case Op::Kind::fixed_array:
      case Op::Kind::tagged:
      case Op::Kind::member:
      case Op::Kind::choice:
      case Op::Kind::alternative:
        break;  // unknown members in the input are skipped
    }
    if (!most || sum + *most > too_many) {
      return std::nullopt;
    }
    sum += *most;
    i = next;
  }
  return sum;
}

}  // namespace

std::optional<std::size_t> most_someip_bytes(const Program& program) {
  return most_of(program, 0, program.ops.size());
}

std::size_t room_to_receive(std::size_t most_bytes) noexcept {
  constexpr std::size_t protection = 64;  // more than the longest header
  const std::size_t all = most_bytes + protection;
  return all <= someip::max_plain_payload_bytes ? someip::max_plain_payload_bytes
                                                : all + someip::max_plain_payload_bytes;
}

}  // namespace trestle::messages
