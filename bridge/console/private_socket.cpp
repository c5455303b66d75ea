#include "bridge/console/private_socket.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <boost/system/system_error.hpp>
#include <cerrno>

namespace trestle::console {

using Protocol = boost::asio::local::stream_protocol;

Protocol::acceptor listen_for_user(boost::asio::io_context& io, const std::filesystem::path& path,
                                   std::size_t backlog) {
  const std::filesystem::path hidden = path.string() + ".new";
  ::unlink(hidden.c_str());
  Protocol::acceptor acceptor{io};
  acceptor.open();
  acceptor.bind(Protocol::endpoint{hidden.string()});
  if (::chmod(hidden.c_str(), S_IRUSR | S_IWUSR) != 0) {
    throw boost::system::system_error{errno, boost::system::system_category(), hidden.string()};
  }
  acceptor.listen(static_cast<int>(backlog));
  if (::rename(hidden.c_str(), path.c_str()) != 0) {
    throw boost::system::system_error{errno, boost::system::system_category(), path.string()};
  }
  return acceptor;
}

}  // namespace trestle::console
