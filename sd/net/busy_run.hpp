#pragma once
#include <boost/asio/io_context.hpp>

#include "someip/wire/types.hpp"

namespace trestle::sd {

/// Runs an io_context as its run() does, for one thread, but looks for work for some time before it waits for
/// the system: what comes in between is found without a wake-up. It takes the whole of a core meanwhile.
/// @param busy  for how long; read anew each time. 0: it waits at once.
void run_busy(boost::asio::io_context& io, const Duration& busy);

}  // namespace trestle::sd
