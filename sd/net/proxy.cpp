#include "sd/net/proxy.hpp"

#include <algorithm>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>

#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"

namespace trestle::sd {
namespace {

std::optional<someip::e2e::CheckResult> copy_of(const someip::e2e::CheckResult* check) {
  return check != nullptr ? std::optional{*check} : std::nullopt;
}

/// How long until a call that could not be sent is tried again. When a server comes it is tried at once.
constexpr Duration retry_period = std::chrono::milliseconds{100};
/// "Forever", without an overflow of what is added to it.
constexpr Duration longest_timeout = std::chrono::hours{24 * 365};

}  // namespace

struct Proxy::Call {
  Call(boost::asio::io_context& io, const CallSpec& what, std::vector<std::byte> bytes, Done then)
      : spec{what},
        payload{std::make_shared<const std::vector<std::byte>>(std::move(bytes))},
        done{std::move(then)},
        deadline{now() + std::min(what.timeout, longest_timeout)},
        retry{io} {}

  CallSpec spec;
  std::shared_ptr<const std::vector<std::byte>> payload;
  Done done;  ///< empty: the call has ended
  TimePoint deadline;
  CallId id{};           ///< while it is outstanding
  bool waiting = false;  ///< for the service, or for a connection
  boost::asio::steady_timer retry;
};

struct Proxy::State : std::enable_shared_from_this<State> {
  explicit State(Node& owner) : node{owner}, io{owner.io()} {}

  void attempt(const std::shared_ptr<Call>& call) {
    call->waiting = false;
    CallSpec spec = call->spec;
    spec.timeout = std::max(call->deadline - now(), Duration{});
    const ByteView bytes{*call->payload};
    call->id = node.call(
        requirement, spec, {&bytes, 1},
        [weak = weak_from_this(), call](const CallResult& result) {
          if (const auto self = weak.lock(); self && call->done) {
            self->on_result(call, result);
          }
        },
        call->payload);
  }

  void on_result(const std::shared_ptr<Call>& call, const CallResult& result) {
    call->id = {};
    if (result) {
      finish(call, {},
             {result->header, {result->payload.begin(), result->payload.end()}, copy_of(result->check)});
      return;
    }
    const CallError& error = result.error();
    switch (error.fault) {
      case CallFault::unavailable:
      case CallFault::not_connected:
        // The request has not left, so that trying again cannot carry it out twice.
        wait(call, error.fault);
        break;
      case CallFault::error:
        finish(call, make_error_code(error.code),
               {{.method = call->spec.method, .type = someip::MessageType::error, .return_code = error.code},
                {error.payload.begin(), error.payload.end()},
                copy_of(error.check)});
        break;
      case CallFault::not_sent:
      case CallFault::too_many_calls:
      case CallFault::timed_out:
        finish(call, error.fault, {});
        break;
    }
  }

  void wait(const std::shared_ptr<Call>& call, CallFault why) {
    const auto waits = [](const auto& one) { return one->waiting; };
    if (now() >= call->deadline) {
      finish(call, why, {});
    } else if (std::ranges::count_if(calls, waits) >= std::ptrdiff_t{max_waiting_calls}) {
      finish(call, CallFault::too_many_calls, {});
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
    for (const auto& call : calls) {
      if (call->waiting) {
        call->retry.cancel();
        attempt(call);
      }
    }
  }

  /// Takes the call out; the handler must be called next, and nothing done after that.
  [[nodiscard]] Done end(const std::shared_ptr<Call>& call) {
    std::erase(calls, call);
    if (call->id != CallId{}) {
      node.cancel(std::exchange(call->id, {}));
    }
    call->waiting = false;
    call->retry.cancel();
    return std::exchange(call->done, nullptr);
  }
  void finish(const std::shared_ptr<Call>& call, boost::system::error_code error, Response response) {
    const Done done = end(call);
    done(error, std::move(response));
  }
  /// As what is called by the user, who does not expect to be called back before that returns.
  void abort(const std::shared_ptr<Call>& call) {
    boost::asio::post(io, [done = end(call)] { done(boost::asio::error::operation_aborted, {}); });
  }
  void close() {
    node.release(requirement);
    while (!calls.empty()) {
      abort(std::shared_ptr{calls.back()});
    }
    closed = true;
  }

  Node& node;
  boost::asio::io_context& io;
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

std::shared_ptr<Proxy::Call> Proxy::make_call(const std::shared_ptr<State>& state, const CallSpec& spec,
                                              std::vector<std::byte> payload, Done done) {
  check(spec);
  return std::make_shared<Call>(state->io, spec, std::move(payload), std::move(done));
}

void Proxy::begin(const std::shared_ptr<State>& state, const std::shared_ptr<Call>& call) {
  boost::asio::dispatch(state->io, [state, call] {
    state->calls.push_back(call);
    if (state->closed) {
      state->abort(call);  // destroyed before the thread of the io_context took up the call
    } else {
      state->attempt(call);
    }
  });
}

void Proxy::cancel(const std::weak_ptr<State>& state, const std::weak_ptr<Call>& call) {
  const auto context = state.lock();
  if (!context) {
    return;
  }
  boost::asio::dispatch(context->io, [state, call] {
    const auto self = state.lock();
    const auto one = call.lock();
    if (self && one && one->done) {
      self->abort(one);
    }
  });
}

}  // namespace trestle::sd
