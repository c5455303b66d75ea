// bridge/messages/convert: from CDR to a SOME/IP payload and back.
//
//   conversion_plan.hpp    the interface: compile a type under rules, convert in both directions
//   message_rules.hpp      the rules of one route: payload layout, tags, unions, fixed strings
//   plan_compiler.cpp      type and rules become a program; program/ has its operations, and what comes out
//   cdr_to_someip.cpp, someip_to_cdr.cpp  run the program; converter.hpp is what both share
//   quick/                 quick ways to do the same, behind quick.hpp; Execution::plain does without
//   service_plans.hpp      the two plans of a service
//
// docs/conversion.md says which bytes come out.
#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/convert/program/output.hpp"
#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/convert/quick/quick.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "someip/wire/tag.hpp"

namespace trestle::messages {

/// Why a message cannot be converted. What is on the wire is at fault, never the bridge: drop the message and
/// count it.
enum class ConversionFault : std::uint8_t {
  truncated,          ///< the bytes end before the message does, or a length or count says more than there is
  bad_encapsulation,  ///< CDR: the first four bytes are not those of plain CDR (XCDR1)
  trailing_bytes,     ///< CDR: more than padding follows; the sender's type is another one
  bound_exceeded,     ///< more elements or characters than the type's bound
  bad_bool,           ///< CDR: a bool that is neither 0 nor 1
  bad_string,         ///< a string without its terminator or BOM, or with a zero inside
  bad_encoding,       ///< characters that are not valid UTF-8 or UTF-16, where they have to be converted
  bad_length,         ///< SOME/IP: a length field that is no multiple of its elements, or not a fixed array's
  length_overflow,    ///< to SOME/IP: more bytes than a length field can say
  too_large,       ///< the input has more than max_converted_bytes, or defaults more than max_default_bytes
  bad_tag,         ///< SOME/IP: a wire type that is not the member's, or a member twice
  missing_member,  ///< SOME/IP: a tagged member that is not optional is not there
  bad_union,       ///< no alternative or several at once; SOME/IP: a type that names none
  not_in_table,    ///< a value for which a mapping of fields has no other one
};

/// The fault's name as it stands above, for logs and counters.
[[nodiscard]] const char* to_string(ConversionFault fault) noexcept;
inline constexpr std::size_t conversion_faults = 14;

/// Larger inputs are refused.
inline constexpr std::size_t max_converted_bytes = (std::size_t{1} << 31U) - 1;
/// Bytes of CDR that defaults may take in one message: they take none in SOME/IP.
inline constexpr std::size_t max_default_bytes = std::size_t{1} << 20U;
/// Fields that a type may have when those of nested messages are counted wherever they are used.
inline constexpr std::size_t max_fields_per_type = 65536;

/// Why an input was refused, and where. Nothing of it has been converted; drop it and count the fault.
struct ConversionError {
  ConversionFault fault = ConversionFault::truncated;
  std::size_t offset = 0;   ///< in the input, of the item at fault
  std::string field{};      ///< "fields[3].name"; empty: the message as a whole
  std::string expected{};   ///< "4 bytes wanted, 0 left"
  bool is_wide = false;     ///< the field is a wstring
  bool is_between = false;  ///< the offset is in what a FieldMap makes or is given, not in the input
};

/// "truncated at byte 17 in fields[3].name"
[[nodiscard]] std::string place_of(const ConversionError& error);
/// "truncated at byte 17 in fields[3].name: 4 bytes wanted, 0 left"
[[nodiscard]] std::string to_string(const ConversionError& error);

/// Where a tagged member of the input stands, while the struct that holds it is converted.
struct MemberPlace {
  std::size_t at = 0;  ///< behind the tag
  std::size_t end = 0;
  someip::WireType type{};
  bool is_there = false;
};

/// Memory for conversions, one after another: for their results, and for what quick::Memory remembers of the
/// messages before. In steady state nothing is allocated.
///
/// Made once by the caller, for one thread; the members after reserve() are for the converters.
class ConversionScratch {
 public:
  /// Makes room for results of which `bytes` are copied, not referenced.
  void reserve(std::size_t bytes) { output_.reserve(bytes); }

  [[nodiscard]] Output& output() noexcept { return output_; }
  [[nodiscard]] quick::Memory& memory() noexcept { return memory_; }
  [[nodiscard]] const quick::Memory& memory() const noexcept { return memory_; }
  /// Places of the members of all structs that are being converted, the innermost struct's last.
  [[nodiscard]] std::vector<MemberPlace>& members() noexcept { return members_; }

 private:
  Output output_;
  quick::Memory memory_;
  std::vector<MemberPlace> members_;
};

/// A message type compiled together with the wire rules of a service: converts between the CDR that DDS
/// carries and the SOME/IP payload, in both directions, without intermediate objects.
///
/// What the two sides look like, and what is accepted from them, is in docs/conversion.md.
class ConversionPlan {
 public:
  /// How messages are converted: with what quick/quick.hpp has, or by one operation after another, which
  /// takes longer. Both make the same of each message; tests compare them.
  enum class Execution : std::uint8_t { quick, plain };

  /// Runs of bytes that conversion leaves as they are become slices of their own from this size on: below it
  /// a copy is cheaper than one more slice.
  static constexpr std::size_t default_reference_from = 4096;

  /// @param reference_from  as above; SIZE_MAX copies everything.
  /// @return the plan, or one line that says why the type cannot be carried under these rules.
  [[nodiscard]] static tl::expected<ConversionPlan, std::string> compile(
      const TypeTree& tree, const MessageRules& rules, std::size_t reference_from = default_reference_from,
      Execution execution = Execution::quick);

  /// @param sample  CDR in either byte order, with its 4 byte encapsulation header; up to 3 bytes of padding
  ///                may follow, and more where Program::may_be_longer says so.
  /// @return the payload, which lives as Gathered says.
  [[nodiscard]] tl::expected<Gathered, ConversionError> cdr_to_someip(ByteView sample,
                                                                      ConversionScratch& scratch) const;

  /// @param payload  a SOME/IP message's payload. Bytes after the message's last field are ignored.
  ///                 [feat_req_someip_168]
  /// @return CDR in the host's byte order with its encapsulation header, which lives as Gathered says.
  [[nodiscard]] tl::expected<Gathered, ConversionError> someip_to_cdr(ByteView payload,
                                                                      ConversionScratch& scratch) const;

  /// Asks for the memory that a conversion will look at, so that it comes while something else is done.
  void expect(ByteView message, const ConversionScratch& scratch) const noexcept;

  /// The compiled program, for tests and for printing.
  [[nodiscard]] const Program& program() const noexcept { return program_; }

 private:
  ConversionPlan(Program program, std::size_t reference_from)
      : program_{std::move(program)}, reference_from_{reference_from} {}

  Program program_;
  std::size_t reference_from_;
};

}  // namespace trestle::messages
