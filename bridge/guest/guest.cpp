#include "bridge/guest/guest.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "bridge/console/status_place.hpp"
#include "bridge/guest/host.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::guest {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using boost::system::error_code;
using Protocol = asio::local::stream_protocol;

constexpr timeval patience{.tv_sec = 3, .tv_usec = 0};

std::string no_answer_of(const fs::path& path) {
  return path.string() + ": the bridge does not answer; it may be stopped, or very busy";
}

/// Connected, or closed; `fault` says what a person can do something about.
Protocol::socket connect(asio::io_context& io, const fs::path& path, std::string& fault) {
  Protocol::socket socket{io};
  const int number = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  const std::string name = path.string();
  if (number < 0 || name.size() >= sizeof address.sun_path) {
    if (number >= 0) {
      ::close(number);
    }
    return socket;
  }
  socket.assign(Protocol{}, number);
  std::memcpy(static_cast<void*>(address.sun_path), name.data(), name.size());
  const auto try_it = [&] {
    return ::connect(number, static_cast<const sockaddr*>(static_cast<const void*>(&address)),
                     sizeof address) == 0;
  };
  // The queue of those who connect is short: where it stays full, the bridge is stuck.
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{patience.tv_sec};
  bool connected = try_it();
  while (!connected && errno == EAGAIN && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(Host::spacing);
    connected = try_it();
  }
  if (!connected) {
    if (errno == ECONNREFUSED) {
      console::remove_left_behind(path);  // of a bridge that was killed
    } else if (errno == EACCES || errno == EPERM) {
      fault = name + ": a bridge of another user";
    } else if (errno != ENOENT) {
      fault = no_answer_of(path);
    }
    socket.close();
    return socket;
  }
  ::fcntl(number, F_SETFL, ::fcntl(number, F_GETFL) & ~O_NONBLOCK);
  ::setsockopt(number, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  ::setsockopt(number, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  return socket;
}

std::optional<Hello> hello_of(Protocol::socket& socket) {
  // By the system's call, which has a time limit.
  const auto receive = [&](ByteSpan room) {
    while (!room.empty()) {
      const ssize_t bytes = ::read(socket.native_handle(), room.data(), room.size());
      if (bytes <= 0) {
        return false;
      }
      room = room.subspan(static_cast<std::size_t>(bytes));
    }
    return true;
  };
  std::array<std::byte, length_bytes> length{};
  if (!receive(length)) {
    return std::nullopt;
  }
  std::vector<std::byte> body(
      std::min<std::size_t>(someip::load<std::uint32_t>(length.data()), most_frame_bytes));
  const auto frame = receive(body) ? decode(body) : std::nullopt;
  const Hello* const hello = frame ? std::get_if<Hello>(&*frame) : nullptr;
  return hello == nullptr ? std::nullopt : std::optional{*hello};
}

}  // namespace

std::unique_ptr<Guest> Guest::of(asio::io_context& io, const Endpoint& at, std::vector<std::string>& faults) {
  for (const fs::path& path : console::guest_sockets(console::status_folders())) {
    std::string fault;
    Protocol::socket socket = connect(io, path, fault);
    auto hello = socket.is_open() ? hello_of(socket) : std::nullopt;
    if (socket.is_open() && !hello) {
      fault = no_answer_of(path);
    }
    if (!fault.empty()) {
      faults.push_back(std::move(fault));
    }
    if (hello && hello->at == at) {
      return std::make_unique<Guest>(std::move(socket), std::move(*hello));
    }
  }
  return nullptr;
}

void Guest::say(const Frame& frame) {
  const std::vector<std::byte> bytes = encode(frame);
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  send();
}

void Guest::send() {
  if (!sending_.empty() || waiting_.empty()) {
    return;
  }
  sending_ = std::exchange(waiting_, {});
  asio::async_write(socket_, asio::buffer(sending_), [this](error_code error, std::size_t) {
    if (!error) {
      sending_.clear();
      send();
    }
  });
}

void Guest::listen(std::function<void(Frame)> handler, std::function<void()> ended) {
  handler_ = std::move(handler);
  ended_ = std::move(ended);
  read_length();
}

void Guest::read_length() {
  asio::async_read(socket_, asio::buffer(length_), [this](error_code error, std::size_t) {
    if (error == asio::error::operation_aborted) {
      return;
    }
    const std::size_t size = someip::load<std::uint32_t>(length_.data());
    if (error || size > most_frame_bytes) {
      ended_();
      return;
    }
    body_.resize(size);
    asio::async_read(socket_, asio::buffer(body_), [this](error_code failed, std::size_t) {
      if (failed == asio::error::operation_aborted) {
        return;
      }
      auto frame = failed ? std::nullopt : decode(body_);
      if (!frame) {
        ended_();
        return;
      }
      handler_(std::move(*frame));
      read_length();
    });
  });
}

}  // namespace trestle::guest
