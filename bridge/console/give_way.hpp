#pragma once
#include <sys/resource.h>
#include <unistd.h>

namespace trestle::console {

/// The calling thread gives way to all others, as Linux has it. Where that is not granted, it is as all
/// others.
inline void give_way() {
  constexpr int nice = 10;
  [[maybe_unused]] const int result = ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
}

}  // namespace trestle::console
