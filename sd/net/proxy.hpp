#pragma once
#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <vector>

#include "sd/net/call_errors.hpp"
#include "sd/net/node.hpp"
#include "sd/net/room.hpp"
#include "someip/net/parameters.hpp"
#include "someip/net/pool_allocator.hpp"

namespace trestle::sd {

/// What a call brought. Of an error: method, return code and any payload. Without an answer, nothing.
struct Response {
  someip::Header header{};
  std::vector<std::byte> payload{};
  std::optional<someip::e2e::CheckResult> check{};  ///< of an answer with end-to-end protection
};

/// A service of others, looked for as long as this object lives, whose methods can be called. The Node must
/// outlive it.
class Proxy {
 public:
  /// @param handler  is told of each server that comes and goes. It may destroy the Proxy.
  /// @throws as Node::require().
  Proxy(Node& node, const RequireSpec& service, AvailabilityHandler handler = {});
  /// Outstanding calls end with boost::asio::error::operation_aborted.
  ~Proxy();
  Proxy(Proxy&& other) noexcept = default;
  Proxy& operator=(Proxy&& other) noexcept;
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  using Signature = void(boost::system::error_code error, Response response);
  /// Calls waiting for the service at once; further ones end with CallFault::too_many_calls.
  static constexpr std::size_t max_waiting_calls = 1024;

  /// Calls a method, or a field's getter or setter. If the service, or the TCP connection to it, is not there
  /// yet, the call waits for it. `spec.timeout` is the time for both, waiting and the answer.
  ///
  /// May be called on any thread while the io_context runs, unlike all else here. The errors are in
  /// call_errors.hpp; when the service did not appear in time it is CallFault::unavailable. Throws
  /// std::invalid_argument for an impossible pacing, as Node::notify(). It allocates the response's payload
  /// and, when more calls wait than ever before, some memory that it keeps.
  ///
  /// @param token  what is to be done with the response, as everywhere in Asio: a function of an error_code
  ///               and a Response, called later on the thread that runs the io_context, or on the executor
  ///               that is associated with it; boost::asio::use_future to get a std::future<Response>;
  ///               use_awaitable, deferred and so on. It may be cancelled by its slot.
  template <typename Token>
  auto call(const CallSpec& spec, std::vector<std::byte> payload, Token&& token) {
    return boost::asio::async_initiate<Token, Signature>(
        [](auto handler, const std::shared_ptr<State>& state, const CallSpec& what,
           std::vector<std::byte> bytes) { start(std::move(handler), state, what, std::move(bytes)); },
        token, state_, spec, std::move(payload));
  }

  /// Calls a method that gives no response. `keep_alive` as in Node::send().
  /// @return false when the service is not there now, or the request could not be sent.
  bool send(const CallSpec& spec, ByteView payload, std::shared_ptr<const void> keep_alive = nullptr) const;

  /// Waits until there is room for a request of so many bytes, as Node::when_room(): after
  /// CallFault::not_sent. May be called on any thread while the io_context runs.
  /// @param token  as in Offer::room().
  template <typename Token>
  auto room(const CallSpec& spec, std::size_t bytes, Token&& token) const {
    return async_room(
        context_of(*state_),
        [state = state_, spec, bytes](std::function<void()> told) {
          when_room(*state, spec, bytes, std::move(told));
        },
        std::forward<Token>(token));
  }

  /// The servers that offer it now.
  [[nodiscard]] std::vector<RemoteService> available() const;

 private:
  struct State;
  /// One that has not ended, with all that it needs: this is the request's payload's owner, too.
  struct Call {
    /// @throws std::invalid_argument for a pacing that cannot be.
    Call(boost::asio::io_context& io, const CallSpec& what, std::vector<std::byte> bytes);
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    virtual ~Call() = default;
    /// Calls the handler, as its executor does. Once.
    virtual void complete(boost::system::error_code error, Response response) = 0;

    CallSpec spec;
    std::vector<std::byte> payload;
    TimePoint deadline;
    CallId id{};           ///< while it is outstanding
    bool waiting = false;  ///< for the service, or for a connection
    bool ended = false;
    boost::asio::steady_timer retry;
  };
  template <typename Handler>
  struct CallFor final : Call {
    CallFor(boost::asio::io_context& io, const CallSpec& what, std::vector<std::byte> bytes, Handler then)
        : Call{io, what, std::move(bytes)},
          handler{std::move(then)},
          work{boost::asio::make_work_guard(handler, io)} {}
    void complete(boost::system::error_code error, Response response) override {
      const auto executor = work.get_executor();
      boost::asio::dispatch(
          executor, [own = std::move(handler), guard = std::move(work), error,
                     answer = std::move(response)]() mutable { std::move(own)(error, std::move(answer)); });
    }

    Handler handler;
    decltype(boost::asio::make_work_guard(std::declval<const Handler&>(),
                                          std::declval<boost::asio::io_context&>())) work;
  };

  template <typename Handler>
  static void start(Handler handler, const std::shared_ptr<State>& state, const CallSpec& spec,
                    std::vector<std::byte>&& payload) {
    auto slot = boost::asio::get_associated_cancellation_slot(handler);
    const std::shared_ptr<Call> call = std::allocate_shared<CallFor<Handler>>(
        memory_of(*state), context_of(*state), spec, std::move(payload), std::move(handler));
    if (slot.is_connected()) {
      slot.assign([weak = std::weak_ptr{state}, one = std::weak_ptr{call}](boost::asio::cancellation_type) {
        cancel(weak, one);
      });
    }
    begin(state, call);
  }
  [[nodiscard]] static boost::asio::io_context& context_of(const State& state) noexcept;
  [[nodiscard]] static const someip::PoolAllocator<std::byte>& memory_of(const State& state) noexcept;
  static void begin(const std::shared_ptr<State>& state, const std::shared_ptr<Call>& call);
  static void when_room(State& state, const CallSpec& spec, std::size_t bytes, std::function<void()> told);
  static void cancel(const std::weak_ptr<State>& state, const std::weak_ptr<Call>& call);

  std::shared_ptr<State> state_;  ///< none: moved from
};

}  // namespace trestle::sd
