#pragma once
#include <cstddef>
#include <span>

/// For programs that system_calls.cpp is part of: on their way to the kernel it sees all calls that send or
/// receive, those of shared libraries too if the program exports its symbols.
namespace trestle::test {

/// Is told, on the thread that makes the call, of each piece of memory that it names.
/// @param what  "send" or "receive".
using OnSystemCall = void (*)(const char* what, std::span<const std::byte> bytes);

/// From now on; before, nobody is told.
void watch_system_calls(OnSystemCall watcher);

}  // namespace trestle::test
