// Property: whatever bytes a connection brings, and however they are cut, the server answers with HTTP and a
// status that it has, or ends the connection; and the handler is asked only what was meant for this host,
// with a path that begins with "/", by no page of a stranger.
//
// Input: a byte that says where the bytes behind it are cut in two; "~" stands for the server's own port.
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <string>

#include "bridge/web/server.hpp"

using namespace trestle;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

struct Site {
  boost::asio::io_context io;
  std::string sent;  ///< in the connection at hand
  web::Server server{
      io,
      {IpAddress::v4(127, 0, 0, 1), 0},
      [this](const web::Request& request, const web::Server::Reply& reply) {
        require(!request.path.empty() && request.path.front() == '/');
        // Somewhere it has to stand that it is meant for this host.
        require(sent.find("127.0.0.1") != std::string::npos || sent.find("localhost") != std::string::npos);
        reply(web::json_answer("{}"));
      },
      {.connections = 4, .header_bytes = 1024, .body_bytes = 512}};
};

/// A connection to it; the peer of what it serves.
int connected(std::uint16_t port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  // No port is kept busy by connections that have ended.
  const linger at_once{1, 0};
  ::setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  require(fd >= 0 && ::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
  return fd;
}

void check(const std::string& answer) {
  if (answer.empty()) {
    return;
  }
  require(answer.starts_with("HTTP/1.1 "));
  constexpr std::array known{"200", "400", "403", "413", "415", "431"};
  bool is_known = false;
  for (const char* const status : known) {
    is_known = is_known || answer.compare(9, 3, status) == 0;
  }
  require(is_known);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  static Site site;
  site.sent.clear();
  for (std::size_t at = 1; at < size; ++at) {
    const char one = static_cast<char>(data[at]);
    site.sent += one == '~' ? std::to_string(site.server.port()) : std::string(1, one);
  }
  const int fd = connected(site.server.port());
  const std::size_t cut = std::min<std::size_t>(data[0], site.sent.size());
  require(::send(fd, site.sent.data(), cut, MSG_NOSIGNAL) == static_cast<ssize_t>(cut));
  site.io.restart();
  site.io.poll();
  (void)::send(fd, site.sent.data() + cut, site.sent.size() - cut, MSG_NOSIGNAL);
  ::shutdown(fd, SHUT_WR);
  site.io.poll();
  std::array<char, 4096> room{};
  const ssize_t got = ::recv(fd, room.data(), room.size(), MSG_DONTWAIT);
  check({room.data(), got > 0 ? static_cast<std::size_t>(got) : 0});
  ::close(fd);
  site.io.poll();
  return 0;
}
