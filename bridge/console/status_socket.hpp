#pragma once
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace trestle::console {

/// Answers everybody who connects to a Unix socket with a text, then closes the connection. Only this user
/// and root may connect. At most `most_clients` at a time are served, who has not read everything after
/// `patience` is left, and the text is not made more often than FreshText says. So whoever connects costs the
/// bridge nothing that counts. On the thread that runs the io_context.
class StatusSocket {
 public:
  static constexpr std::size_t most_clients = 4;
  static constexpr std::chrono::seconds patience{2};

  /// @param folder  of status_folder(). The socket has the name of this process.
  /// @throws boost::system::system_error when it cannot be opened.
  StatusSocket(boost::asio::io_context& io, const std::filesystem::path& folder,
               std::function<std::string()> text);
  /// Removes the socket.
  ~StatusSocket();
  StatusSocket(const StatusSocket&) = delete;
  StatusSocket& operator=(const StatusSocket&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept;

 private:
  class Implementation;
  std::shared_ptr<Implementation> implementation_;
};

}  // namespace trestle::console
