#include "bridge/guest/guest.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <utility>

#include "bridge/console/status_place.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::guest {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using boost::system::error_code;
using Protocol = asio::local::stream_protocol;

constexpr std::chrono::seconds patience{3};

/// With a time limit for each read and write.
Protocol::socket with_limit(asio::io_context& io, int connected) {
  ::fcntl(connected, F_SETFL, ::fcntl(connected, F_GETFL) & ~O_NONBLOCK);
  const timeval limit{.tv_sec = patience.count(), .tv_usec = 0};
  ::setsockopt(connected, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  ::setsockopt(connected, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  return {io, Protocol{}, connected};
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
    const auto connected = console::connect_to(path, patience);
    if (!connected) {
      if (std::string fault = told(connected.error(), path); !fault.empty()) {
        faults.push_back(std::move(fault));
      }
      continue;
    }
    Protocol::socket socket = with_limit(io, *connected);
    auto hello = hello_of(socket);
    if (!hello) {
      faults.push_back(told(console::AskError::no_answer, path));
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
