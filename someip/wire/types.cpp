#include "someip/wire/types.hpp"

#include "someip/wire/enumerator_name.hpp"

namespace trestle::someip {

const char* to_string(WireError error) noexcept {
  static constexpr std::array names{"truncated",
                                    "bad_length",
                                    "no_room",
                                    "bad_tp_offset",
                                    "bad_tp_flags",
                                    "bad_string_encoding",
                                    "bad_union_type",
                                    "bad_tag",
                                    "not_sd",
                                    "bad_entries_length",
                                    "bad_options_length",
                                    "bad_option_length",
                                    "bad_entry_type",
                                    "bad_option_reference",
                                    "bad_value"};
  return enumerator_name<WireError::bad_value>(names, error);
}

}  // namespace trestle::someip
