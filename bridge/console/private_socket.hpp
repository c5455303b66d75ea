#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <filesystem>

namespace trestle::console {

/// Listens at a Unix socket to which only this user and root may connect. It appears under its name only when
/// somebody listens and others are kept out: a socket that nobody listens at is taken for one that was left
/// behind.
/// @throws boost::system::system_error
[[nodiscard]] boost::asio::local::stream_protocol::acceptor listen_for_user(boost::asio::io_context& io,
                                                                            const std::filesystem::path& path,
                                                                            std::size_t backlog);

}  // namespace trestle::console
