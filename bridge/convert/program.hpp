#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "someip/wire/payload_rules.hpp"

/// The form into which ConversionPlan compiles a type, and which the two converters execute. One program
/// serves both directions: it lists what is on the wire, each converter reads it on one side and writes the
/// other.
namespace trestle::bridge {

/// One operation: a run of fields that both wire formats treat alike.
struct Op {
  enum class Kind : std::uint8_t {
    numbers,          ///< `count` numbers of `width` bytes, from any number of neighbouring fields
    bools,            ///< `count` booleans
    string,           ///< of at most `bound` bytes
    wstring,          ///< of at most `bound` UTF-16 units
    number_sequence,  ///< up to `bound` elements, each `count` numbers of `width` bytes
    bool_sequence,    ///< up to `bound` elements, each `count` booleans
    sequence,         ///< up to `bound` elements, each what the body says
    repeat,           ///< `count` times what the body says
    structure,        ///< the body, behind a length field on the SOME/IP side
    fixed_array,      ///< the same, but the body must fill the length exactly
  };
  Kind kind = Kind::numbers;
  std::uint8_t width = 1;
  std::uint32_t end = 0;  ///< the body is the operations from the next one up to here
  std::uint64_t count = 1;
  std::uint64_t bound = 0;
  std::uint64_t min_cdr = 0;     ///< sequence, repeat: fewest bytes that one element has in CDR; at least 1
  std::uint64_t min_someip = 0;  ///< and in SOME/IP; at least 1
};

/// Names a field within an operation, for errors.
struct Label {
  std::uint64_t first = 0;   ///< the operation's number that is the field's first
  std::uint64_t stride = 0;  ///< numbers of one array element; 0: no array
  std::string path;          ///< "transforms[].header.stamp.sec": [] for each enclosing loop
};

/// A compiled type. Every converter only reads it, so one program may serve many threads.
struct Program {
  std::vector<Op> ops;
  std::vector<std::vector<Label>> labels;  ///< for each operation, at least one, sorted by `first`
  someip::PayloadRules rules;
};

}  // namespace trestle::bridge
