// bridge/console: how a running bridge is looked at from outside.
//
//   status_place.hpp   where running bridges are found on this host, and how one is asked
//   status_socket.hpp  a bridge's end of that: answers with its picture
//   fresh_text.hpp     texts that are not made more often than they are worth
//   metrics.hpp        a picture as metrics, for Prometheus
//   shown_message.hpp  the newest message of a route, as values and as bytes
//   sight.hpp          what there is to see of it: points, pictures, positions, frames
//   console.hpp        serves all of these over HTTP, with the page of bridge/web/assets/console
//   record_process.hpp a record that the page begins and ends, made by a process of its own
//   viewers.hpp        clients of Foxglove's WebSocket protocol, by a thread of its own
//   viewer.hpp         one of them, without a socket; foxglove.hpp: the texts of the protocol
//   inbox.hpp          messages on their way to that thread
//   route_forms.hpp    what these become for viewers; json_schema.hpp: and what that looks like
//
// Reads pictures and copies of messages (bridge/picture) alone; nothing here knows how they are made.
#pragma once
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace trestle::console {

/// The folder in which a bridge of this process has its socket, made if it is not there: in XDG_RUNTIME_DIR,
/// else /run/trestle, else /tmp/trestle-UID.
/// @return the first that can be written to, or why there is none.
[[nodiscard]] tl::expected<std::filesystem::path, std::string> status_folder();

/// All folders in which bridges of this host may have theirs, as far as this process may see.
[[nodiscard]] std::vector<std::filesystem::path> status_folders();

/// The name of a process's socket: "1234.sock".
[[nodiscard]] std::string socket_name(int pid);

/// That of its socket for tools that use its address (bridge/guest): "1234.guests".
[[nodiscard]] std::string guest_socket_name(int pid);

/// Removes the sockets of a process that was killed, if that is allowed.
/// @param socket  one of them, at which nobody listens.
void remove_left_behind(const std::filesystem::path& socket);

/// The sockets for asking in the folders, by name.
[[nodiscard]] std::vector<std::filesystem::path> status_sockets(
    const std::vector<std::filesystem::path>& folders);
/// Likewise, those for tools.
[[nodiscard]] std::vector<std::filesystem::path> guest_sockets(
    const std::vector<std::filesystem::path>& folders);

/// What the bridge behind a socket answers.
enum class AskError : std::uint8_t {
  gone,         ///< nobody has the socket any more; it was removed, if that is allowed
  not_allowed,  ///< it is another user's
  no_answer,    ///< nothing, or not all, in time
};

/// For people: "/run/trestle/1234.sock: a bridge of another user". Empty for one that is gone.
[[nodiscard]] std::string told(AskError error, const std::filesystem::path& socket);

/// Connects to a bridge's socket. Reads and writes do not wait.
/// @param limit  so long it is tried again where too many others are just connecting.
/// @return the descriptor, which the caller has to close.
[[nodiscard]] tl::expected<int, AskError> connect_to(const std::filesystem::path& socket,
                                                     std::chrono::milliseconds limit);

/// @param limit  for all of it.
/// @param max_bytes  of the answer; a longer one counts as none.
[[nodiscard]] tl::expected<std::string, AskError> ask(const std::filesystem::path& socket,
                                                      std::chrono::milliseconds limit,
                                                      std::size_t max_bytes = std::size_t{64} << 20U);

}  // namespace trestle::console
