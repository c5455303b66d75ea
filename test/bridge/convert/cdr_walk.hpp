#pragma once
#include <bit>
#include <vector>

#include "bridge/types/message_definition.hpp"
#include "someip/wire/types.hpp"

namespace trestle::test {

/// Reads a CDR sample field by field with eProsima's fastcdr and writes it again with fastcdr in the given
/// byte order: what a Fast DDS application would understand by the sample.
[[nodiscard]] std::vector<std::byte> rewritten_by_fastcdr(const bridge::TypeTree& tree, ByteView sample,
                                                          std::endian order);

}  // namespace trestle::test
