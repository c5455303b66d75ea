#pragma once
#include <chrono>
#include <string>

#include "someip/wire/types.hpp"

namespace trestle::someip {

/// TLS of TCP connections: which peers we trust, and how we prove who we are. Either certificates, with which
/// both ends prove themselves, or a key that both ends know (PSK). TLS 1.2 or 1.3.
struct TlsSettings {
  std::string certificate_file{};  ///< own certificate in PEM, then those between it and the root
  std::string key_file{};          ///< its private key in PEM, without a passphrase
  std::string ca_file{};           ///< PEM: the roots of which one must have signed the peer's certificate
  /// The name that the peer's certificate must have, as DNS name or common name; empty: any.
  std::string peer_name{};
  std::string psk_identity{};  ///< the name of the key
  std::string psk_key_file{};  ///< a file with the key in hexadecimal digits, 16 to 64 bytes
  /// A connection over which the handshake takes longer is closed. It counts as a connection meanwhile.
  Duration handshake_timeout = std::chrono::seconds{5};
  friend bool operator==(const TlsSettings&, const TlsSettings&) = default;
};

/// What contradicts itself in the settings, or is missing; empty: nothing. Reads no file.
[[nodiscard]] std::string mistake_in(const TlsSettings& settings);

/// Whether this library was built with TLS (CMake: TRESTLE_TLS).
[[nodiscard]] bool has_tls() noexcept;

}  // namespace trestle::someip
