#include "someip/net/tls.hpp"

namespace trestle::someip {

std::string mistake_in(const TlsSettings& settings) {
  const bool has_certificates =
      !settings.certificate_file.empty() || !settings.key_file.empty() || !settings.ca_file.empty();
  const bool has_psk = !settings.psk_identity.empty() || !settings.psk_key_file.empty();
  if (has_certificates && has_psk) {
    return "either certificates or a key that both ends know, not both";
  }
  if (!has_certificates && !has_psk) {
    return "needs a certificate, key and ca, or a psk_identity and psk_key";
  }
  if (has_certificates &&
      (settings.certificate_file.empty() || settings.key_file.empty() || settings.ca_file.empty())) {
    return "certificates need all three: certificate, key and ca";
  }
  if (has_psk && (settings.psk_identity.empty() || settings.psk_key_file.empty())) {
    return "needs both psk_identity and psk_key";
  }
  if (has_psk && !settings.peer_name.empty()) {
    return "peer_name: there is none without certificates";
  }
  if (settings.psk_identity.size() > 128) {
    return "psk_identity: longer than 128 bytes";
  }
  return settings.handshake_timeout <= Duration::zero() ? "handshake_timeout: must be longer than 0" : "";
}

}  // namespace trestle::someip
