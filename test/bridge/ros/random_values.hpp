#pragma once
#include <nlohmann/json.hpp>

#include <random>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::test {

/// Values for every field of the type, within its bounds, as `trestle call` and others take them.
nlohmann::json random_values(const messages::TypeTree& tree, std::mt19937& random);

}  // namespace trestle::test
