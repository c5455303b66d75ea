#pragma once
#include <bit>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"
#include "someip/wire/payload_rules.hpp"
#include "someip/wire/types.hpp"

namespace trestle::test {

/// Reads a CDR sample field by field with eProsima's fastcdr and writes it again with fastcdr in the given
/// byte order: what a Fast DDS application would understand by the sample.
[[nodiscard]] std::vector<std::byte> rewritten_by_fastcdr(const messages::TypeTree& tree, ByteView sample,
                                                          std::endian order);

/// Reads a CDR sample with fastcdr and writes it with someip::PayloadWriter: what an application on this
/// project's SOME/IP library would send. The type must have no wstring, which PayloadWriter doesn't know.
[[nodiscard]] std::vector<std::byte> written_by_payload_writer(const messages::TypeTree& tree,
                                                               ByteView sample,
                                                               const someip::PayloadRules& rules);

/// Whether a wstring is somewhere in the type.
[[nodiscard]] bool has_wstring(const messages::TypeTree& tree);

}  // namespace trestle::test
