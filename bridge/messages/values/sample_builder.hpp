#pragma once
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/values/text_value.hpp"
#include "bridge/messages/values/words.hpp"
#include "someip/wire/types.hpp"

namespace trestle::messages {

/// Makes the CDR sample, in the host's byte order, that a text describes.
/// @param max_bytes  larger samples are refused.
/// @param words      names that the text may have; null: those of the types.
/// @param choose     a choice of which the text says nothing is its first member; else that is an error.
/// @return the sample, or the first thing in the text that does not suit the type.
[[nodiscard]] tl::expected<std::vector<std::byte>, ValueError> build_sample(const TextValue& text,
                                                                            const TypeTree& tree,
                                                                            std::size_t max_bytes,
                                                                            const Words* words = nullptr,
                                                                            bool choose = false);

}  // namespace trestle::messages
