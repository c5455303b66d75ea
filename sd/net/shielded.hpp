#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <exception>

namespace trestle::sd {

/// Calls something that calls handlers of the application. What a handler throws comes out of the io_context
/// afterwards: it does not keep us from doing the rest, for which nobody else would come.
template <typename Function>
void shielded(boost::asio::io_context& io, Function function) {
  try {
    function();
  } catch (...) {
    boost::asio::post(io, [thrown = std::current_exception()] { std::rethrow_exception(thrown); });
  }
}

}  // namespace trestle::sd
