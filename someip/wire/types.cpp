#include "someip/wire/types.hpp"

namespace trestle::someip {

const char* to_string(WireError error) noexcept {
  switch (error) {
    case WireError::truncated:
      return "truncated";
    case WireError::bad_length:
      return "bad_length";
    case WireError::no_room:
      return "no_room";
    case WireError::bad_tp_offset:
      return "bad_tp_offset";
    case WireError::bad_tp_flags:
      return "bad_tp_flags";
    case WireError::bad_string_encoding:
      return "bad_string_encoding";
    case WireError::bad_union_type:
      return "bad_union_type";
    case WireError::bad_tag:
      return "bad_tag";
    case WireError::not_sd:
      return "not_sd";
    case WireError::bad_entries_length:
      return "bad_entries_length";
    case WireError::bad_options_length:
      return "bad_options_length";
    case WireError::bad_option_length:
      return "bad_option_length";
    case WireError::bad_entry_type:
      return "bad_entry_type";
    case WireError::bad_option_reference:
      return "bad_option_reference";
    case WireError::bad_value:
      return "bad_value";
  }
  return "unknown";
}

}  // namespace trestle::someip
