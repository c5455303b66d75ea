#pragma once
#include <cstddef>

#include "sd/net/node_config.hpp"

/// Programs as docs/application.md has them, and no option that it does not ask for. Servers run until they
/// are killed; clients print what `trestle perf --json` has by these names.
namespace trestle::newcomer {

/// A method that answers with what it got.
void serve_echo(const sd::NodeConfig& config);
/// Calls it over UDP, one call after another.
void call_echo(const sd::NodeConfig& config, std::size_t bytes, double seconds);

/// An event of 64 bytes, again and again while somebody is subscribed to it: each from a handler of its own.
void serve_events(const sd::NodeConfig& config);
void count_events(const sd::NodeConfig& config, double seconds);

}  // namespace trestle::newcomer
