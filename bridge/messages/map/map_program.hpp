#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "bridge/messages/map/number_map.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

inline constexpr std::uint32_t no_slot = std::numeric_limits<std::uint32_t>::max();

/// Goes over a part of the message that is there. What is wanted of it is noted in a slot.
struct ReadOp {
  enum class Kind : std::uint8_t {
    numbers,   ///< so many of a width
    sequence,  ///< a count, and numbers of a width
    string,
    wstring,
    place,  ///< nothing: notes where the next part begins, which may be read as a whole, too
    other,  ///< whatever its type is
  };
  Kind kind = Kind::numbers;
  std::uint8_t width = 1;
  std::uint32_t slot = no_slot;
  std::uint32_t type = 0;  ///< other: index of MapProgram::types
  std::uint64_t count = 1;
};

/// Where a part of the message stands.
struct Slot {
  std::size_t at =
      0;  ///< of numbers: the first one; of strings: their length; of others: where the part begins
  std::size_t count = 0;  ///< of numbers
};

/// Writes the next part of the message that is made.
struct WriteOp {
  enum class Kind : std::uint8_t {
    number,       ///< as it is
    mapped,       ///< what becomes of it
    constant,     ///< `bits`
    blank,        ///< so many numbers
    array,        ///< of fixed size, as it is, or what becomes of its numbers
    sequence,     ///< likewise, with its count
    string,       ///< as it is
    wstring,      ///< as it is
    text,         ///< always the same string: index of MapProgram::texts
    wide_text,    ///< likewise, index of MapProgram::wide_texts
    other,        ///< all of an array of strings or messages
    received,     ///< the time at which the message came: seconds and nanoseconds
    time,         ///< the same of a number
    time_number,  ///< a number of a Time or Duration
  };
  Kind kind = Kind::number;
  std::uint8_t width = 1;
  TimeUnit unit = TimeUnit::ns;
  bool is_mapped = false;  ///< array, sequence: by `map`
  std::uint32_t slot = no_slot;
  std::uint32_t element = 0;  ///< number, mapped: of an array
  std::uint32_t map = 0;      ///< index of MapProgram::maps
  std::uint32_t index = 0;    ///< of texts; other: of MapProgram::types, of the part that is read
  std::uint32_t to_type = 0;  ///< other: likewise, of the part that is written
  std::uint32_t bound = std::numeric_limits<std::uint32_t>::max();  ///< most elements or characters
  std::uint64_t count = 1;                                          ///< blank; array: how many it has
  std::uint64_t bits = 0;
};

/// A mapping in one direction, ready to run. Both messages are CDR.
struct MapProgram {
  TypeTree from;
  TypeTree to;
  std::vector<ReadOp> reads;
  std::vector<std::string> read_labels;  ///< of each: the field
  std::vector<WriteOp> writes;
  std::vector<std::string> write_labels;
  std::vector<std::string> write_sources;  ///< the field that it is made of; empty: none
  std::vector<NumberMap> maps;
  std::vector<FieldType> types;
  std::vector<std::string> texts;
  std::vector<std::vector<std::uint32_t>> wide_texts;  ///< UTF-16, a unit each
  std::uint32_t slots = 0;
  bool may_be_longer = false;  ///< as Program::may_be_longer, of the message that is read
  bool needs_time = false;     ///< of its coming
};

}  // namespace trestle::messages
