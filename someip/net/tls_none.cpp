// In place of tls_openssl.cpp, in builds without OpenSSL.
#include <stdexcept>

#include "someip/net/tls_channel.hpp"

namespace trestle::someip {

bool has_tls() noexcept {
  return false;
}

std::shared_ptr<const TlsContext> make_tls_context(const TlsSettings& settings) {
  static_cast<void>(settings);
  throw std::invalid_argument{"this program was built without TLS (CMake: TRESTLE_TLS)"};
}

}  // namespace trestle::someip
