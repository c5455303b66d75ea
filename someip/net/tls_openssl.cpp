#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <new>
#include <stdexcept>
#include <vector>

#include "someip/net/tls_channel.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t record_bytes = 16384;  // the most that one record carries
constexpr std::size_t psk_bytes_min = 16;
constexpr std::size_t psk_bytes_max = 64;

template <auto free>
struct Free {
  template <typename Of>
  void operator()(Of* one) const noexcept {
    free(one);
  }
};
using ContextPtr = std::unique_ptr<SSL_CTX, Free<SSL_CTX_free>>;
using SslPtr = std::unique_ptr<SSL, Free<SSL_free>>;

// What OpenSSL says of the last failure, which it forgets then.
std::string last_error() {
  std::string text;
  while (const unsigned long code = ERR_get_error()) {
    const char* const reason = ERR_reason_error_string(code);
    text = reason == nullptr ? "error " + std::to_string(code) : reason;  // the last one says most
  }
  return text;
}

// --- The socket: as OpenSSL's own, but a peer that is gone raises no signal -------------------------------

int socket_of(BIO* bio) {
  return *static_cast<int*>(BIO_get_data(bio));
}

bool must_wait() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

int write_socket(BIO* bio, const char* bytes, int size) {
  BIO_clear_retry_flags(bio);
  const ssize_t sent = ::send(socket_of(bio), bytes, static_cast<std::size_t>(size), MSG_NOSIGNAL);
  if (sent < 0 && must_wait()) {
    BIO_set_retry_write(bio);
  }
  return static_cast<int>(sent);
}

int read_socket(BIO* bio, char* bytes, int size) {
  BIO_clear_retry_flags(bio);
  const ssize_t received = ::recv(socket_of(bio), bytes, static_cast<std::size_t>(size), 0);
  if (received < 0 && must_wait()) {
    BIO_set_retry_read(bio);
  }
  return static_cast<int>(received);
}

long control_socket(BIO* /*bio*/, int command, long /*number*/, void* /*pointer*/) {
  return command == BIO_CTRL_FLUSH ? 1 : 0;
}

BIO_METHOD* socket_method() {
  static BIO_METHOD* const method = [] {
    BIO_METHOD* const made = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "trestle socket");
    if (made != nullptr) {
      BIO_meth_set_write(made, write_socket);
      BIO_meth_set_read(made, read_socket);
      BIO_meth_set_ctrl(made, control_socket);
    }
    return made;  // for the life of the process
  }();
  return method;
}

// --- One connection ---------------------------------------------------------------------------------------

class Channel final : public TlsChannel {
 public:
  Channel(SSL_CTX* context, int fd, StreamEnd own, const std::string& peer_name)
      : fd_{fd}, ssl_{SSL_new(context)} {
    BIO* const bio = ssl_ == nullptr || socket_method() == nullptr ? nullptr : BIO_new(socket_method());
    if (bio == nullptr) {
      ERR_clear_error();
      throw std::bad_alloc{};
    }
    BIO_set_data(bio, &fd_);
    BIO_set_init(bio, 1);
    SSL_set_bio(ssl_.get(), bio, bio);  // which owns it now
    if (!peer_name.empty() && SSL_set1_host(ssl_.get(), peer_name.c_str()) != 1) {
      ERR_clear_error();
      throw std::bad_alloc{};
    }
    if (own == StreamEnd::server) {
      // In TLS 1.3 a key is a session that is gone on with: who verifies takes none without a context, which
      // a client must not have.
      constexpr std::array<unsigned char, 7> name{'t', 'r', 'e', 's', 't', 'l', 'e'};
      if (SSL_set_session_id_context(ssl_.get(), name.data(), name.size()) != 1) {
        ERR_clear_error();
        throw std::bad_alloc{};
      }
      SSL_set_accept_state(ssl_.get());
    } else {
      SSL_set_connect_state(ssl_.get());
    }
  }
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  ~Channel() override {
    if (is_done_ && !has_failed_) {
      static_cast<void>(SSL_shutdown(ssl_.get()));
    }
    ERR_clear_error();
  }

  [[nodiscard]] Step handshake() override {
    ERR_clear_error();
    const int result = SSL_do_handshake(ssl_.get());
    if (result == 1) {
      is_done_ = true;
      return Step::done;
    }
    const int system_error = errno;
    switch (SSL_get_error(ssl_.get(), result)) {
      case SSL_ERROR_WANT_READ:
        return Step::to_receive;
      case SSL_ERROR_WANT_WRITE:
        return Step::to_send;
      case SSL_ERROR_SYSCALL:
        note_failure(system_error);
        return Step::failed;
      default:
        note_failure(0);
        if (const long verdict = SSL_get_verify_result(ssl_.get()); verdict != X509_V_OK) {
          error_ += std::string{" ("} + X509_verify_cert_error_string(verdict) + ")";
        }
        return Step::failed;
    }
  }

  [[nodiscard]] std::string error() const override { return error_; }

  [[nodiscard]] ssize_t receive(std::span<const iovec> places) override {
    ssize_t total = 0;
    for (const iovec& place : places) {
      std::size_t filled = 0;
      while (filled < place.iov_len) {
        if (const ssize_t more =
                receive_into(static_cast<char*>(place.iov_base) + filled, place.iov_len - filled);
            more > 0) {
          filled += static_cast<std::size_t>(more);
          total += more;
        } else if (total > 0) {
          is_end_seen_ = more == 0 || errno != EAGAIN;  // the next call tells
          return total;
        } else {
          return more;
        }
      }
    }
    return total;
  }

  [[nodiscard]] ssize_t send(std::span<const iovec> parts) override {
    if (!flush()) {
      return -1;
    }
    if (record_ == nullptr) {
      record_ = std::make_unique<char[]>(record_bytes);
    }
    for (const iovec& part : parts) {
      const std::size_t size = std::min(part.iov_len, record_bytes - waiting_);
      if (size > 0) {  // an empty part has no place
        std::memcpy(record_.get() + waiting_, part.iov_base, size);
        waiting_ += size;
      }
    }
    const auto taken = static_cast<ssize_t>(waiting_);
    if (!flush() && errno != EAGAIN) {
      return -1;
    }
    return taken;
  }

  [[nodiscard]] bool flush() override {
    while (waiting_ > 0) {
      ERR_clear_error();
      std::size_t written = 0;
      // Without partial writes: all of it, or the same again.
      const int result = SSL_write_ex(ssl_.get(), record_.get(), waiting_, &written);
      if (result != 1) {
        errno = reason_of(result);
        return false;
      }
      waiting_ = 0;
    }
    return true;
  }

  [[nodiscard]] bool waits_to_send() const noexcept override { return waiting_ > 0 || reading_has_to_send_; }
  [[nodiscard]] bool has_unread() const noexcept override {
    return is_end_seen_ || SSL_pending(ssl_.get()) > 0;
  }

 private:
  ssize_t receive_into(char* place, std::size_t size) {
    ERR_clear_error();
    std::size_t received = 0;
    const int result = SSL_read_ex(ssl_.get(), place, size, &received);
    reading_has_to_send_ = false;
    if (result == 1) {
      return static_cast<ssize_t>(received);
    }
    const int reason = SSL_get_error(ssl_.get(), result);
    if (reason == SSL_ERROR_ZERO_RETURN) {
      return 0;
    }
    reading_has_to_send_ = reason == SSL_ERROR_WANT_WRITE;
    errno = reason_of(result);
    return -1;
  }

  // As an errno; also notes the words.
  int reason_of(int result) {
    const int system_error = errno;
    switch (SSL_get_error(ssl_.get(), result)) {
      case SSL_ERROR_WANT_READ:
      case SSL_ERROR_WANT_WRITE:
        return EAGAIN;
      case SSL_ERROR_SYSCALL:
        note_failure(system_error);
        return system_error == 0 ? ECONNRESET : system_error;
      default:
        note_failure(0);
        return EPROTO;
    }
  }

  void note_failure(int system_error) {
    has_failed_ = true;
    const std::string said = last_error();
    error_ = !said.empty()       ? said
             : system_error != 0 ? std::string{std::strerror(system_error)}
                                 : "the peer closed the connection";
  }

  int fd_;
  SslPtr ssl_;
  bool is_done_ = false;
  bool has_failed_ = false;  ///< then nothing may be sent any more
  bool is_end_seen_ = false;
  bool reading_has_to_send_ = false;
  std::size_t waiting_ = 0;           ///< bytes of `record_`
  std::unique_ptr<char[]> record_{};  ///< what was taken from send() and has not been sent
  std::string error_{};
};

// --- What connections have in common ----------------------------------------------------------------------

int digit_of(char character) {
  if (character >= '0' && character <= '9') {
    return character - '0';
  }
  const char lower = static_cast<char>(character | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

std::vector<unsigned char> read_key(const std::string& name) {
  std::ifstream file{name};
  if (!file.is_open()) {
    throw std::invalid_argument{"psk_key: cannot read " + name};
  }
  std::vector<unsigned char> key;
  std::string digits;
  file >> digits;
  std::string rest;
  const bool is_one_word = !(file >> rest);
  const bool is_hex = std::ranges::all_of(digits, [](char character) { return digit_of(character) >= 0; });
  if (!is_one_word || !is_hex || digits.size() % 2 != 0 || digits.size() < 2 * psk_bytes_min ||
      digits.size() > 2 * psk_bytes_max) {
    throw std::invalid_argument{"psk_key: " + name +
                                " has to hold one key of 16 to 64 bytes in hexadecimal digits"};
  }
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    key.push_back(static_cast<unsigned char>(16 * digit_of(digits[i]) + digit_of(digits[i + 1])));
  }
  return key;
}

class Context final : public TlsContext {
 public:
  explicit Context(const TlsSettings& settings)
      : TlsContext{settings.handshake_timeout},
        context_{SSL_CTX_new(TLS_method())},
        peer_name_{settings.peer_name},
        identity_{settings.psk_identity} {
    if (context_ == nullptr) {
      ERR_clear_error();
      throw std::bad_alloc{};
    }
    SSL_CTX* const context = context_.get();
    SSL_CTX_set_app_data(context, this);
    SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
    // Nothing is kept for later connections, and nothing is negotiated again.
    SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
    SSL_CTX_set_num_tickets(context, 0);
    SSL_CTX_set_options(context, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
    SSL_CTX_set_mode(context, SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER | SSL_MODE_RELEASE_BUFFERS);
    if (identity_.empty()) {
      use_certificates(settings);
    } else {
      use_key(settings);
    }
  }

  [[nodiscard]] std::unique_ptr<TlsChannel> open(int fd, StreamEnd own) const override {
    return std::make_unique<Channel>(context_.get(), fd, own, peer_name_);
  }

 private:
  void use_certificates(const TlsSettings& settings) {
    SSL_CTX* const context = context_.get();
    const auto check = [](int result, const std::string& what) {
      if (result != 1) {
        throw std::invalid_argument{what + ": " + last_error()};
      }
    };
    ERR_clear_error();
    check(SSL_CTX_use_certificate_chain_file(context, settings.certificate_file.c_str()),
          "certificate: " + settings.certificate_file);
    check(SSL_CTX_use_PrivateKey_file(context, settings.key_file.c_str(), SSL_FILETYPE_PEM),
          "key: " + settings.key_file);
    check(SSL_CTX_check_private_key(context), "key: " + settings.key_file);
    check(SSL_CTX_load_verify_locations(context, settings.ca_file.c_str(), nullptr),
          "ca: " + settings.ca_file);
    check(SSL_CTX_set_cipher_list(context, "ECDHE+AESGCM:ECDHE+CHACHA20"), "cipher list");
    SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  }

  // In TLS 1.3 the same callbacks give the external key, which goes with suites of SHA-256.
  void use_key(const TlsSettings& settings) {
    key_ = read_key(settings.psk_key_file);
    SSL_CTX* const context = context_.get();
    if (SSL_CTX_set_cipher_list(
            context, "kECDHEPSK+AESGCM:kECDHEPSK+CHACHA20:kPSK+AESGCM:kPSK+CHACHA20:kPSK+AESCCM") != 1 ||
        SSL_CTX_set_ciphersuites(context, "TLS_AES_128_GCM_SHA256:TLS_CHACHA20_POLY1305_SHA256") != 1) {
      throw std::invalid_argument{"psk: " + last_error()};
    }
    // A server that does not know the key may offer a certificate instead: none is trusted.
    SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
    SSL_CTX_set_psk_client_callback(
        context,
        [](SSL* ssl, const char*, char* identity, unsigned identity_size, unsigned char* key,
           unsigned key_size) -> unsigned {
          const Context& self = of(ssl);
          if (self.identity_.size() >= identity_size || self.key_.size() > key_size) {
            return 0;
          }
          std::memcpy(identity, self.identity_.c_str(), self.identity_.size() + 1);
          std::ranges::copy(self.key_, key);
          return static_cast<unsigned>(self.key_.size());
        });
    SSL_CTX_set_psk_server_callback(
        context, [](SSL* ssl, const char* identity, unsigned char* key, unsigned key_size) -> unsigned {
          const Context& self = of(ssl);
          if (identity == nullptr || self.identity_ != identity || self.key_.size() > key_size) {
            return 0;
          }
          std::ranges::copy(self.key_, key);
          return static_cast<unsigned>(self.key_.size());
        });
  }

  static const Context& of(SSL* ssl) {
    return *static_cast<const Context*>(SSL_CTX_get_app_data(SSL_get_SSL_CTX(ssl)));
  }

  ContextPtr context_;
  std::string peer_name_;
  std::string identity_;
  std::vector<unsigned char> key_{};
};

}  // namespace

bool has_tls() noexcept {
  return true;
}

std::shared_ptr<const TlsContext> make_tls_context(const TlsSettings& settings) {
  if (const std::string mistake = mistake_in(settings); !mistake.empty()) {
    throw std::invalid_argument{mistake};
  }
  return std::make_shared<const Context>(settings);
}

}  // namespace trestle::someip
