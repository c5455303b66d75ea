#include "sd/net/proxy.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/bind_allocator.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <utility>

#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"
#include "someip/net/pool_allocator.hpp"

namespace trestle::sd {
namespace {

std::optional<someip::e2e::CheckResult> copy_of(const someip::e2e::CheckResult* check) {
  return check != nullptr ? std::optional{*check} : std::nullopt;
}

/// The time until a call that could not be sent is tried again. When a server comes, it is tried at once.
constexpr Duration retry_period = std::chrono::milliseconds{100};
/// Practically for ever, but additions do not overflow.
constexpr Duration longest_timeout = std::chrono::hours{24 * 365};
/// The payload of a response is kept for the next one up to this size.
constexpr std::size_t most_kept_bytes = std::size_t{1} << 20U;
/// Who takes the payload of a response may keep it for long, so it has no more room than this to spare, or
/// half of it.
constexpr std::size_t most_spare_bytes = 4096;

/// Memory for the calls of one thread, kept for those that come next.
class Blocks {
 public:
  Blocks() = default;
  Blocks(const Blocks&) = delete;
  Blocks& operator=(const Blocks&) = delete;
  ~Blocks() {
    for (Free* free : free_) {
      while (free != nullptr) {
        ::operator delete(std::exchange(free, free->next));
      }
    }
  }
  [[nodiscard]] void* take(std::size_t bytes) {
    const std::size_t steps = steps_of(bytes);
    if (steps >= free_.size() || free_[steps] == nullptr) {
      return ::operator new(steps* step_bytes);
    }
    return std::exchange(free_[steps], free_[steps]->next);
  }
  void give_back(void* place, std::size_t bytes) noexcept {
    const std::size_t steps = steps_of(bytes);
    if (steps >= free_.size()) {
      ::operator delete(place);
    } else {
      free_[steps] = new (place) Free{free_[steps]};
    }
  }

 private:
  struct Free {
    Free* next;
  };
  static constexpr std::size_t step_bytes = 64;
  [[nodiscard]] static constexpr std::size_t steps_of(std::size_t bytes) noexcept {
    return (bytes + step_bytes - 1) / step_bytes;
  }

  std::array<Free*, 16> free_{};  ///< by their size in steps
};

[[nodiscard]] constexpr std::size_t units_of(std::size_t bytes) noexcept {
  return (bytes + sizeof(std::max_align_t) - 1) / sizeof(std::max_align_t);
}

}  // namespace

struct Proxy::State : std::enable_shared_from_this<State> {
  explicit State(Node& owner) : node{owner}, io{owner.io()} {}
  ~State() {
    if (gone != nullptr) {
      *gone = true;
    }
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  /// While a handler is called, which may destroy the State: this costs less than to own it meanwhile.
  class Watch {
   public:
    explicit Watch(State& state) noexcept : state_{state}, outer_{std::exchange(state.gone, &gone_)} {}
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;
    ~Watch() {
      if (!gone_) {
        state_.gone = outer_;
      } else if (outer_ != nullptr) {
        *outer_ = true;
      }
    }
    [[nodiscard]] bool gone() const noexcept { return gone_; }

   private:
    State& state_;
    bool* outer_;  ///< of a handler within which this one is called
    bool gone_ = false;
  };

  /// A call that is under way to a handler of Asio, with what has its memory.
  struct Held {
    std::shared_ptr<State> state;
    CallPtr call;
  };

  void add(CallPtr own, ByteView bytes) {
    Call& call = *own;
    call.place = calls.size();
    call.number = ++last_number;
    calls.push_back(std::move(own));
    if (closed) {  // before the thread of the io_context took up the call
      end_later(call, boost::asio::error::operation_aborted);
    } else {
      attempt(call, bytes);
    }
  }

  void attempt(Call& call, ByteView bytes) {
    call.waiting = false;
    if (call.deadline) {
      call.spec.timeout = std::max(*call.deadline - now(), Duration{});
    }
    // `this` and the call exist as long as the Node has this handler: end() removes it. It is small enough
    // for std::function to need no memory.
    const auto started = node.try_call(
        requirement, call.spec, {&bytes, 1},
        [this, one = &call](const CallResult& result) { on_result(*one, result); }, call.payload);
    if (call.ended) {  // who owned what had to make room for it has destroyed the Proxy; end_later() holds
                       // both
      if (started) {
        node.cancel(*started);
      }
    } else if (started) {
      call.id = *started;
    } else if (started.error() == CallFault::unavailable || started.error() == CallFault::not_connected) {
      wait(call, bytes, started.error());
    } else {
      end_later(call, started.error());
    }
  }

  void on_result(Call& call, const CallResult& result) {
    call.id = {};
    Response response{.payload = std::exchange(spare, {})};
    boost::system::error_code error;
    if (result) {
      response.header = result->header;
      fill(response.payload, result->payload);
      response.check = copy_of(result->check);
    } else if (const CallError& why = result.error(); why.fault == CallFault::error) {
      error = make_error_code(why.code);
      response.header = {
          .method = call.spec.method, .type = someip::MessageType::error, .return_code = why.code};
      fill(response.payload, why.payload);
      response.check = copy_of(why.check);
    } else {
      error = why.fault;
      response.payload.clear();
    }
    CallPtr own = end(call);
    const Watch watch{*this};
    call.complete(std::move(own), error, std::move(response));
    // The handler has left it there, or it is empty.
    if (!watch.gone() && response.payload.capacity() <= most_kept_bytes) {
      spare = std::move(response.payload);
    }
  }

  static void fill(std::vector<std::byte>& payload, ByteView bytes) {
    if (payload.capacity() > 2 * bytes.size() + most_spare_bytes) {
      payload = std::vector<std::byte>{};
    }
    payload.assign(bytes.begin(), bytes.end());
  }

  /// Keeps the payload for as long as the call, or its request, needs it.
  /// @param own  the vector that it is, to be taken; nothing: it is copied.
  void keep(Call& call, ByteView bytes, std::vector<std::byte>* own) {
    using Bytes = std::vector<std::byte>;
    call.payload = own != nullptr ? std::allocate_shared<const Bytes>(memory, std::move(*own))
                                  : std::allocate_shared<const Bytes>(memory, bytes.begin(), bytes.end());
  }

  static void set_deadline(Call& call) { call.deadline = now() + call.spec.timeout; }

  // The request has not been sent, so a retry cannot execute it twice.
  void wait(Call& call, ByteView bytes, CallFault why) {
    if (!call.deadline) {
      set_deadline(call);
    }
    const auto waits = [](const CallPtr& one) { return one->waiting; };
    if (now() >= *call.deadline) {
      end_later(call, why);
    } else if (std::ranges::count_if(calls, waits) >= std::ptrdiff_t{max_waiting_calls}) {
      end_later(call, CallFault::too_many_calls);
    } else {
      if (!call.payload) {
        keep(call, bytes, nullptr);
      }
      if (!call.retry) {
        call.retry.emplace(io);
      }
      call.waiting = true;
      call.retry->expires_at(std::min(*call.deadline, now() + retry_period));
      call.retry->async_wait(
          [weak = weak_from_this(), number = call.number](const boost::system::error_code& error) {
            const auto self = weak.lock();
            Call* const one = self && !error ? self->find(&Call::number, number) : nullptr;
            if (one != nullptr && one->waiting) {
              self->attempt(*one, *one->payload);
            }
          });
    }
  }

  void on_server() {
    std::vector<Call*> all;  // those that end meanwhile live on: end_later()
    for (const CallPtr& call : calls) {
      if (call->waiting) {
        all.push_back(call.get());
      }
    }
    std::ranges::sort(all, {}, &Call::number);
    for (Call* const call : all) {
      if (call->waiting) {
        call->retry->cancel();
        attempt(*call, *call->payload);
      }
    }
  }

  [[nodiscard]] Call* find(std::uint64_t Call::*which, std::uint64_t number) const {
    const auto found = std::ranges::find(calls, number, [&](const CallPtr& one) { return (*one).*which; });
    return found == calls.end() ? nullptr : found->get();
  }

  /// Removes the call. After its handler has been called, nothing may be accessed.
  [[nodiscard]] CallPtr end(Call& call) {
    std::swap(calls[call.place], calls.back());
    calls[call.place]->place = call.place;
    CallPtr own = std::move(calls.back());
    calls.pop_back();
    if (call.id != CallId{}) {
      node.cancel(std::exchange(call.id, {}));
    }
    call.waiting = false;
    call.ended = true;
    if (call.retry) {
      call.retry->cancel();
    }
    return own;
  }
  /// For functions that the user calls: no callback is expected before they return. Until then it exists.
  void end_later(Call& call, boost::system::error_code error) {
    boost::asio::post(io, [held = Held{shared_from_this(), end(call)}, error]() mutable {
      Call& ended = *held.call;
      ended.complete(std::move(held.call), error, {});
    });
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
  someip::PoolAllocator<std::max_align_t> memory;  ///< any thread's
  Blocks blocks;                                   ///< of the thread of the io_context
  std::atomic<std::uint64_t> last_ticket{0};
  std::uint64_t last_number = 0;
  RequirementId requirement{};
  std::vector<CallPtr> calls;
  std::vector<std::byte> spare;  ///< has been the payload of a response
  bool closed = false;
  bool* gone = nullptr;  ///< a Watch's
};

Proxy::Call::Call(State& state, Thread made_on, const CallSpec& what) noexcept
    : owner{state}, thread{made_on}, spec{what} {
  spec.timeout = std::min(spec.timeout, longest_timeout);
}

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

void Proxy::verify(const CallSpec& spec) {
  check(spec);
}

boost::asio::io_context& Proxy::context_of(const State& state) noexcept {
  return state.io;
}

Proxy::Thread Proxy::this_thread(const State& state) noexcept {
  return state.io.get_executor().running_in_this_thread() ? Thread::own : Thread::other;
}

void* Proxy::take(State& state, Thread thread, std::size_t bytes, std::size_t alignment) {
  if (alignment > alignof(std::max_align_t)) {
    return ::operator new (bytes, std::align_val_t{alignment});
  }
  return thread == Thread::own ? state.blocks.take(bytes) : state.memory.allocate(units_of(bytes));
}

void Proxy::when_room(State& state, const CallSpec& spec, std::size_t bytes, std::function<void()> told) {
  if (state.closed) {  // the Node may be gone, too
    boost::asio::post(state.io, std::move(told));
  } else {
    state.node.when_room(state.requirement, spec, bytes, std::move(told));
  }
}

void Proxy::give_back(State& state, Thread thread, void* place, std::size_t bytes,
                      std::size_t alignment) noexcept {
  if (alignment > alignof(std::max_align_t)) {
    ::operator delete (place, std::align_val_t{alignment});
  } else if (thread == Thread::own) {
    state.blocks.give_back(place, bytes);
  } else {
    state.memory.deallocate(static_cast<std::max_align_t*>(place), units_of(bytes));
  }
}

void Proxy::begin(const std::shared_ptr<State>& state, CallPtr call, ByteView payload,
                  std::vector<std::byte>* own) {
  const bool large = payload.size() > someip::max_plain_payload_bytes;
  if (call->thread == Thread::other || (own != nullptr && large)) {
    state->keep(*call, payload, own);
  }
  if (call->thread == Thread::own) {
    const ByteView bytes = call->payload ? ByteView{*call->payload} : payload;
    state->add(std::move(call), bytes);
    return;
  }
  State::set_deadline(*call);
  boost::asio::post(state->io, boost::asio::bind_allocator(
                                   state->memory, [held = State::Held{state, std::move(call)}]() mutable {
                                     const ByteView bytes{*held.call->payload};
                                     held.state->add(std::move(held.call), bytes);
                                   }));
}

std::uint64_t Proxy::new_ticket(State& state) noexcept {
  return ++state.last_ticket;
}

void Proxy::cancel(const std::weak_ptr<State>& state, std::uint64_t ticket) {
  const auto context = state.lock();
  if (!context) {
    return;
  }
  // Not at once, even on its thread: a call of another thread may still be under way to it.
  boost::asio::post(context->io, [state, ticket] {
    const auto self = state.lock();
    if (Call* const call = self ? self->find(&Call::ticket, ticket) : nullptr) {
      self->end_later(*call, boost::asio::error::operation_aborted);
    }
  });
}

}  // namespace trestle::sd
