#include "sd/net/proxy.hpp"

#include <algorithm>
#include <boost/asio/bind_allocator.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <utility>

#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"

namespace trestle::sd {
namespace {

std::optional<someip::e2e::CheckResult> copy_of(const someip::e2e::CheckResult* check) {
  return check != nullptr ? std::optional{*check} : std::nullopt;
}

/// The time until a call that could not be sent is tried again. When a server comes, it is tried at once.
constexpr Duration retry_period = std::chrono::milliseconds{100};
/// Practically for ever, but additions do not overflow.
constexpr Duration longest_timeout = std::chrono::hours{24 * 365};

}  // namespace

Proxy::Call::Call(boost::asio::io_context& io, const CallSpec& what, std::vector<std::byte> bytes)
    : spec{what},
      payload{std::move(bytes)},
      deadline{now() + std::min(what.timeout, longest_timeout)},
      retry{io} {
  check(spec);
}

struct Proxy::State : std::enable_shared_from_this<State> {
  explicit State(Node& owner) : node{owner}, io{owner.io()} {}

  void attempt(const std::shared_ptr<Call>& call) {
    call->waiting = false;
    CallSpec spec = call->spec;
    spec.timeout = std::max(call->deadline - now(), Duration{});
    const ByteView bytes{call->payload};
    // `this` and the call exist as long as the Node has this handler: end() removes it. It is small enough
    // for std::function to need no memory.
    const auto started = node.try_call(
        requirement, spec, {&bytes, 1},
        [this, one = call.get()](const CallResult& result) { on_result(*one, result); }, call);
    if (started) {
      call->id = *started;
    } else if (started.error() == CallFault::unavailable || started.error() == CallFault::not_connected) {
      wait(call, started.error());
    } else {
      end_later(*call, started.error());
    }
  }

  void on_result(Call& call, const CallResult& result) {
    call.id = {};
    if (result) {
      finish(call, {},
             {result->header, {result->payload.begin(), result->payload.end()}, copy_of(result->check)});
      return;
    }
    const CallError& error = result.error();
    if (error.fault == CallFault::error) {
      finish(call, make_error_code(error.code),
             {{.method = call.spec.method, .type = someip::MessageType::error, .return_code = error.code},
              {error.payload.begin(), error.payload.end()},
              copy_of(error.check)});
    } else {
      finish(call, error.fault, {});
    }
  }

  // The request has not been sent, so a retry cannot execute it twice.
  void wait(const std::shared_ptr<Call>& call, CallFault why) {
    const auto waits = [](const auto& one) { return one->waiting; };
    if (now() >= call->deadline) {
      end_later(*call, why);
    } else if (std::ranges::count_if(calls, waits) >= std::ptrdiff_t{max_waiting_calls}) {
      end_later(*call, CallFault::too_many_calls);
    } else {
      call->waiting = true;
      call->retry.expires_at(std::min(call->deadline, now() + retry_period));
      call->retry.async_wait([weak = weak_from_this(), call](const boost::system::error_code& error) {
        if (const auto self = weak.lock(); self && !error && call->waiting) {
          self->attempt(call);
        }
      });
    }
  }

  void on_server() {
    const auto all = calls;  // copied: an attempt may end
    for (const auto& call : all) {
      if (call->waiting) {
        call->retry.cancel();
        attempt(call);
      }
    }
  }

  /// Removes the call. After its handler has been called, nothing may be accessed.
  [[nodiscard]] std::shared_ptr<Call> end(Call& call) {
    const auto place = std::ranges::find(calls, &call, &std::shared_ptr<Call>::get);
    std::shared_ptr<Call> own = std::move(*place);
    calls.erase(place);
    if (call.id != CallId{}) {
      node.cancel(std::exchange(call.id, {}));
    }
    call.waiting = false;
    call.ended = true;
    call.retry.cancel();
    return own;
  }
  void finish(Call& call, boost::system::error_code error, Response response) {
    const auto own = end(call);
    own->complete(error, std::move(response));
  }
  /// For functions that the user calls: no callback is expected before they return.
  void end_later(Call& call, boost::system::error_code error) {
    boost::asio::post(io, [own = end(call), error] { own->complete(error, {}); });
  }
  void close() {
    node.release(requirement);
    while (!calls.empty()) {
      end_later(*calls.back(), boost::asio::error::operation_aborted);
    }
    closed = true;
  }

  Node& node;
  boost::asio::io_context& io;
  const someip::PoolAllocator<std::byte> memory;
  RequirementId requirement{};
  std::vector<std::shared_ptr<Call>> calls;
  bool closed = false;
};

Proxy::Proxy(Node& node, const RequireSpec& service, AvailabilityHandler handler)
    : state_{std::make_shared<State>(node)} {
  state_->requirement = node.require(service, [weak = std::weak_ptr{state_}, handler = std::move(handler)](
                                                  const RemoteService& server, bool available) {
    const auto state = weak.lock();
    if (state && available) {
      state->on_server();
    }
    if (state && handler) {
      handler(server, available);
    }
  });
}

Proxy::~Proxy() {
  if (state_) {
    state_->close();
  }
}

Proxy& Proxy::operator=(Proxy&& other) noexcept {
  Proxy old{std::move(*this)};
  state_ = std::move(other.state_);
  return *this;
}

bool Proxy::send(const CallSpec& spec, ByteView payload, std::shared_ptr<const void> keep_alive) const {
  return state_->node.send(state_->requirement, spec, {&payload, 1}, std::move(keep_alive));
}

std::vector<RemoteService> Proxy::available() const {
  return state_->node.available(state_->requirement);
}

boost::asio::io_context& Proxy::context_of(const State& state) noexcept {
  return state.io;
}

const someip::PoolAllocator<std::byte>& Proxy::memory_of(const State& state) noexcept {
  return state.memory;
}

void Proxy::begin(const std::shared_ptr<State>& state, const std::shared_ptr<Call>& call) {
  boost::asio::dispatch(state->io, boost::asio::bind_allocator(state->memory, [state, call] {
                          state->calls.push_back(call);
                          if (state->closed) {  // before the thread of the io_context took up the call
                            state->end_later(*call, boost::asio::error::operation_aborted);
                          } else {
                            state->attempt(call);
                          }
                        }));
}

void Proxy::when_room(State& state, const CallSpec& spec, std::size_t bytes, std::function<void()> told) {
  if (state.closed) {  // the Node may be gone, too
    boost::asio::post(state.io, std::move(told));
  } else {
    state.node.when_room(state.requirement, spec, bytes, std::move(told));
  }
}

void Proxy::cancel(const std::weak_ptr<State>& state, const std::weak_ptr<Call>& call) {
  const auto context = state.lock();
  if (!context) {
    return;
  }
  boost::asio::dispatch(context->io, [state, call] {
    const auto self = state.lock();
    const auto one = call.lock();
    if (self && one && !one->ended) {
      self->end_later(*one, boost::asio::error::operation_aborted);
    }
  });
}

}  // namespace trestle::sd
