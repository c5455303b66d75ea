#pragma once
#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <concepts>
#include <new>
#include <vector>

#include "sd/net/call_errors.hpp"
#include "sd/net/node.hpp"
#include "sd/net/room.hpp"
#include "someip/net/parameters.hpp"

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
  /// std::invalid_argument for an impossible pacing, as Node::notify().
  ///
  /// It allocates when more calls are outstanding than ever before, and keeps that memory; and for a response
  /// that somebody takes, or that is larger than a megabyte.
  ///
  /// @param token  what is to be done with the response, as everywhere in Asio: a function of an error_code
  ///               and a Response, called later on the thread that runs the io_context, or on the executor
  ///               that is associated with it; boost::asio::use_future to get a std::future<Response>;
  ///               use_awaitable, deferred and so on. It may be cancelled by its slot. A function of a
  ///               `const Response&` gets one whose memory the next response uses again.
  template <typename Token>
  auto call(const CallSpec& spec, std::vector<std::byte> payload, Token&& token) {
    return boost::asio::async_initiate<Token, Signature>(
        [](auto handler, const std::shared_ptr<State>& state, const CallSpec& what,
           std::vector<std::byte> bytes) { start(std::move(handler), state, what, bytes, &bytes); },
        token, state_, spec, std::move(payload));
  }
  /// The same with a payload of the caller's, which need only live until the call has begun: with a function
  /// or use_future, until this returns. It is copied if it has to wait, also for the thread of the
  /// io_context.
  template <std::same_as<ByteView> View, typename Token>
  auto call(const CallSpec& spec, View payload, Token&& token) {
    return boost::asio::async_initiate<Token, Signature>(
        [](auto handler, const std::shared_ptr<State>& state, const CallSpec& what, ByteView bytes) {
          start(std::move(handler), state, what, bytes, nullptr);
        },
        token, state_, spec, payload);
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
  class Call;
  struct Release {
    void operator()(Call* call) const noexcept { call->release(); }
  };
  using CallPtr = std::unique_ptr<Call, Release>;
  /// Where a call is made, and thus what memory it has.
  enum class Thread : std::uint8_t { own, other };

  /// One that has not ended. It lives on the thread of the io_context, where no lock is needed; one that
  /// another thread made is handed over once.
  class Call {
   public:
    Call(State& state, Thread made_on, const CallSpec& what) noexcept;
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    /// Ends `self`, then calls the handler, as its executor does.
    virtual void complete(CallPtr self, boost::system::error_code error, Response&& response) = 0;
    /// Destroys it and gives its memory back.
    virtual void release() noexcept = 0;

    State& owner;
    const Thread thread;
    bool waiting = false;  ///< for the service, or for a connection
    bool ended = false;
    CallId id{};               ///< while it is outstanding
    std::size_t place = 0;     ///< among all
    std::uint64_t number = 0;  ///< in the order in which they came to this thread
    std::uint64_t ticket = 0;  ///< to cancel it; 0: nobody can
    CallSpec spec;
    std::shared_ptr<const std::vector<std::byte>> payload{};  ///< nothing: it is the caller's
    std::optional<TimePoint> deadline{};                      ///< nothing: it has just begun
    std::optional<boost::asio::steady_timer> retry{};

   protected:
    ~Call() = default;
  };
  template <typename Handler>
  class CallFor final : public Call {
   public:
    CallFor(State& state, Thread made_on, const CallSpec& what, Handler&& then) noexcept
        : Call{state, made_on, what}, handler_{std::move(then)} {
      const auto own = context_of(state).get_executor();
      const auto executor = boost::asio::get_associated_executor(handler_, own);
      if constexpr (std::is_same_v<decltype(own), decltype(executor)>) {
        if (executor == own) {
          return;
        }
      }
      elsewhere_.emplace(executor);
    }
    void complete(CallPtr self, boost::system::error_code error, Response&& response) override {
      Handler then = std::move(handler_);
      std::optional<Work> elsewhere = std::move(elsewhere_);
      self.reset();  // first, so that a call made by the handler finds this memory
      if (!elsewhere) {
        std::move(then)(error, std::move(response));
        return;
      }
      const auto executor = elsewhere->get_executor();
      boost::asio::dispatch(
          executor, [then = std::move(then), work = std::move(elsewhere), error,
                     answer = std::move(response)]() mutable { std::move(then)(error, std::move(answer)); });
    }
    void release() noexcept override {
      State& state = owner;
      const Thread made_on = thread;
      this->~CallFor();
      give_back(state, made_on, this, sizeof(CallFor), alignof(CallFor));
    }

   private:
    using Work = boost::asio::executor_work_guard<
        boost::asio::associated_executor_t<Handler, boost::asio::io_context::executor_type>>;

    Handler handler_;
    std::optional<Work> elsewhere_{};  ///< its executor, if that is not the io_context's
  };

  /// @param own  the vector that `payload` is, to be taken; nothing: the caller keeps it.
  template <typename Handler>
  static void start(Handler handler, const std::shared_ptr<State>& state, const CallSpec& spec,
                    ByteView payload, std::vector<std::byte>* own) {
    verify(spec);
    auto slot = boost::asio::get_associated_cancellation_slot(handler);
    const Thread thread = this_thread(*state);
    using Made = CallFor<Handler>;
    CallPtr call{new (take(*state, thread, sizeof(Made), alignof(Made)))
                     Made{*state, thread, spec, std::move(handler)}};
    if (slot.is_connected()) {
      call->ticket = new_ticket(*state);
      slot.assign([weak = std::weak_ptr{state}, ticket = call->ticket](boost::asio::cancellation_type) {
        cancel(weak, ticket);
      });
    }
    begin(state, std::move(call), payload, own);
  }
  /// @throws std::invalid_argument for a pacing that cannot be.
  static void verify(const CallSpec& spec);
  [[nodiscard]] static boost::asio::io_context& context_of(const State& state) noexcept;
  [[nodiscard]] static Thread this_thread(const State& state) noexcept;
  [[nodiscard]] static void* take(State& state, Thread thread, std::size_t bytes, std::size_t alignment);
  static void give_back(State& state, Thread thread, void* place, std::size_t bytes,
                        std::size_t alignment) noexcept;
  static void begin(const std::shared_ptr<State>& state, CallPtr call, ByteView payload,
                    std::vector<std::byte>* own);
  static void when_room(State& state, const CallSpec& spec, std::size_t bytes, std::function<void()> told);
  [[nodiscard]] static std::uint64_t new_ticket(State& state) noexcept;
  static void cancel(const std::weak_ptr<State>& state, std::uint64_t ticket);

  std::shared_ptr<State> state_;  ///< none: moved from
};

}  // namespace trestle::sd
