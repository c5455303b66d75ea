#pragma once
#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/system/error_code.hpp>
#include <functional>
#include <memory>
#include <utility>

namespace trestle::sd {

/// How Offer::room() and Proxy::room() end: without an error, or boost::asio::error::operation_aborted when
/// they were cancelled.
using RoomSignature = void(boost::system::error_code error);

/// Waits for room by a completion token of Asio: a function of an error_code, use_future, use_awaitable and
/// so on. It may be cancelled by its slot.
/// @param io     of the Node.
/// @param begin  is called on its thread with a function, which is to be called there once there is room.
template <typename Begin, typename Token>
auto async_room(boost::asio::io_context& io, Begin begin, Token&& token) {
  return boost::asio::async_initiate<Token, RoomSignature>(
      [](auto handler, boost::asio::io_context* context, Begin start) {
        using Handler = decltype(handler);
        struct Waiting {
          Waiting(Handler then, boost::asio::io_context& to)
              : handler{std::move(then)}, work{boost::asio::make_work_guard(handler, to)} {}
          void end(boost::system::error_code error) {
            if (!std::exchange(ended, true)) {
              const auto executor = work.get_executor();
              boost::asio::dispatch(executor, [own = std::move(handler), guard = std::move(work),
                                               error]() mutable { std::move(own)(error); });
            }
          }
          Handler handler;
          decltype(boost::asio::make_work_guard(std::declval<const Handler&>(),
                                                std::declval<boost::asio::io_context&>())) work;
          bool ended = false;
        };
        auto slot = boost::asio::get_associated_cancellation_slot(handler);
        const auto waiting = std::make_shared<Waiting>(std::move(handler), *context);
        if (slot.is_connected()) {
          slot.assign([context, weak = std::weak_ptr{waiting}](boost::asio::cancellation_type) {
            boost::asio::post(*context, [weak] {
              if (const auto still = weak.lock()) {
                still->end(boost::asio::error::operation_aborted);
              }
            });
          });
        }
        boost::asio::dispatch(*context, [waiting, start = std::move(start)]() mutable {
          start(std::function<void()>{[waiting] { waiting->end({}); }});
        });
      },
      token, &io, std::move(begin));
}

}  // namespace trestle::sd
