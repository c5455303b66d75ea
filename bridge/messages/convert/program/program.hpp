// bridge/messages/convert/program: what a type and its wire rules are compiled into, and what comes out.
//
//   program.hpp       operations, with labels and defaults
//   string_frame.hpp  BOM and terminator of strings
//   wire_forms.hpp    lengths, numbers and padding of both wire formats
//   byte_swap.hpp     many numbers in the other byte order
//   output.hpp        what a conversion writes; gathered.hpp: its result, as a list of slices
//
// Knows neither the converters that run a program nor quick/.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "bridge/messages/convert/program/string_frame.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "someip/wire/payload_rules.hpp"
#include "someip/wire/tag.hpp"

/// The form into which ConversionPlan compiles a type, and which the two converters execute. One program
/// serves both directions: it lists what is on the wire, each converter reads it on one side and writes the
/// other.
namespace trestle::messages {

/// One operation: a run of fields that both wire formats treat alike.
struct Op {
  enum class Kind : std::uint8_t {
    numbers,          ///< `count` numbers of `width` bytes, from any number of neighbouring fields
    bools,            ///< `count` booleans
    bits,             ///< `count` booleans, which are one number of `width` bytes in SOME/IP
    packed,           ///< `count` numbers, which have some of the bits of `fixed_bytes` bytes in SOME/IP
    string,           ///< of at most `bound` bytes
    wstring,          ///< of at most `bound` UTF-16 units
    number_sequence,  ///< up to `bound` elements, each `count` numbers of `width` bytes
    bool_sequence,    ///< up to `bound` elements, each `count` booleans
    sequence,         ///< up to `bound` elements, each what the body says
    repeat,           ///< `count` times what the body says
    structure,        ///< the body, behind a length field on the SOME/IP side
    fixed_array,      ///< the same, but what the body leaves of the length are elements too many
    field,            ///< the body; nothing of it in SOME/IP means its default, if `may_miss`
    tagged,           ///< `count` members, behind a length field if `length` says so
    member,           ///< of a tagged struct: the body behind a tag
    choice,       ///< a union whose alternatives are the body; without length field of `count` bytes, which
                  ///< if 0 are as many as needed
    alternative,  ///< of a union, whose type field then is `count`: in CDR none or one of what the body says
  };
  /// What an operation is to the loop of quick/.
  enum class Loop : std::uint8_t {
    no,        ///< nothing: it is left to the converter
    numbers,   ///< few of them
    bools,     ///< few of them
    string,    ///< of UTF-8, in front of which there is a length field
    array,     ///< number_sequence
    if_empty,  ///< sequence of anything, which it does only without elements
  };
  Kind kind = Kind::numbers;
  std::uint8_t width = 1;
  someip::FieldWidth length = someip::FieldWidth::none;  ///< before what has a length in SOME/IP
  bool optional = false;                                 ///< member: in CDR none or one of it
  bool may_miss = false;     ///< field, member: SOME/IP may do without it, and CDR gets the default
  bool is_tagged = false;    ///< choice: the length field counts the type field too
  bool other_order = false;  ///< numbers, bits, number_sequence: not in the byte order of the rules
  Loop loop = Loop::no;      ///< what quick::run() makes of it; as the next three, see quick::choose()
  bool all_in_loop = false;  ///< sequence, repeat: so is all of the body
  bool repeats = false;      ///< what becomes of it depends on its bytes and their place in CDR alone
  std::uint8_t slot = 0;     ///< sequence, structure: of the body's shape in quick::Memory; 0: none
  std::uint8_t frame = 0;    ///< string, wstring: in `frames`
  someip::DataId id{};       ///< member
  someip::FieldWidth type_width = someip::FieldWidth::none;  ///< choice: of its type field
  bool type_first = false;                                   ///< choice: type, length, data
  std::uint32_t end = 0;          ///< the body is the operations from the next one up to here
  std::uint32_t default_at = 0;   ///< field, member: in `defaults`; beyond them: zero
  std::uint32_t members_at = 0;   ///< tagged: in `members`; packed: in `packed`
  std::uint32_t fixed_bytes = 0;  ///< string, wstring, packed: always that many in SOME/IP; 0: as needed
  std::uint64_t count = 1;
  std::uint64_t bound = 0;
  std::uint64_t min_cdr = 0;     ///< sequence, repeat: fewest bytes that one element has in CDR; at least 1
  std::uint64_t min_someip = 0;  ///< and in SOME/IP; at least 1
};

/// A number among others in packed bits.
struct PackedNumber {
  std::uint8_t width = 1;  ///< bytes in CDR
  std::uint8_t bits = 0;   ///< 0: none of it in SOME/IP
  bool is_signed = false;
  bool is_bool = false;  ///< its lowest bit counts
  std::endian order{};   ///< of the bytes that its bits fill
  std::uint32_t at = 0;  ///< the bit at which it begins, from the operation's first byte on
};

/// Names a field within an operation, for errors.
struct Label {
  std::uint64_t first = 0;   ///< the operation's number that is the field's first
  std::uint64_t stride = 0;  ///< numbers of one array element; 0: no array
  std::string path;          ///< "transforms[].header.stamp.sec": [] for each enclosing loop
};

/// The default value of a field of a `.msg` file.
struct DefaultValue {
  Primitive type = Primitive::uint8;
  bool is_sequence = false;            ///< in CDR its count comes first
  std::vector<std::uint64_t> numbers;  ///< the bits of each, in the lowest `width(type)` bytes
  std::vector<std::string> strings;    ///< of strings instead: UTF-8
};

/// Which member of a tagged struct has an id.
struct MemberId {
  someip::DataId id{};
  std::uint32_t index = 0;  ///< counted from 0, in the order of the operations
};

/// Quick ways that fit a program as a whole, chosen by quick::choose(). As they stand here there are none.
struct QuickWays {
  bool loop = false;      ///< there are operations for it
  bool is_usual = false;  ///< all of these have usual_strings and length fields of 32 bits
  bool arrays = false;    ///< Op::Loop::array is among them
  bool front = false;     ///< the front of the message has a shape; it does not begin with the loop
  /// The array of bytes of a message that can have a MessageShape; 0: it cannot.
  std::size_t array_at = 0;
  QuickFrame strings{someip::PayloadRules{}};
};

/// A compiled type. Every converter only reads it, so one program may serve many threads.
struct Program {
  static constexpr std::size_t no_op = std::numeric_limits<std::size_t>::max();

  explicit Program(const someip::PayloadRules& payload_rules = {})
      : rules{payload_rules},
        frames{
            string_frame(rules.string_encoding, rules.string_bom, rules.string_terminator),
            string_frame(wide_encoding(rules.string_encoding), rules.string_bom, rules.string_terminator)} {}

  /// The operation behind the i-th and its body.
  [[nodiscard]] std::size_t behind(std::size_t i) const noexcept {
    return std::max<std::size_t>(i + 1, ops[i].end);
  }

  std::uint64_t number = 0;  ///< its own in this process, from 1; the same in copies
  std::vector<Op> ops;
  std::vector<std::vector<Label>> labels;  ///< for each operation, at least one, sorted by `first`
  std::vector<DefaultValue> defaults;
  std::vector<std::vector<MemberId>> members;  ///< of each tagged struct, sorted by id
  std::vector<std::vector<PackedNumber>> packed;
  someip::PayloadRules rules;
  std::vector<StringFrame> frames;  ///< that of strings, that of wstrings, then those of single fields
  QuickWays quick;
  /// CDR samples may be longer than the message: rmw_fastrtps writes down its estimate of their size where an
  /// application serializes them itself (`serialize_message()`, bags written so), and the estimate has too
  /// many bytes for wstrings and for empty sequences of 8 byte numbers. What stands in them is no part of the
  /// message.
  bool may_be_longer = false;
};

}  // namespace trestle::messages
